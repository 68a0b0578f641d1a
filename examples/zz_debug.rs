use ddem::*;
fn main() {
    let text = std::fs::read_to_string(std::env::args().nth(1).unwrap()).unwrap();
    let deck = ddem::io::deck::parse(&text, "x").unwrap().0;
    let mut s = Simulation::new(Model::new(&deck).unwrap());
    let n: u64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let _ = s.relax(1e-12, n);
    let f = s.forces();
    let u = s.displacements();
    let mut order: Vec<usize> = (0..f.len()).collect();
    let size = |i: usize| f[i].iter().map(|x| x * x).sum::<f64>();
    order.sort_by(|a, b| size(*b).total_cmp(&size(*a)));
    for &i in order.iter().take(12) {
        println!("{i} block {} at {:?} f {:?} u {:?}", i / 8, s.model().point(i), f[i], u[i]);
    }
}
