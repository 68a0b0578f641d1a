use ddem_io::run::*;
struct O;
impl Observer for O {
    fn event(&mut self, e: Event<'_>) {
        match e {
            Event::Progress(p) => eprintln!("{p:?}"),
            e => eprintln!("{e:?}"),
        }
    }
}
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let (deck, source) = match ddem_io::deck::read(path.as_ref()) {
        Ok(x) => x,
        Err(e) => {
            eprintln!("{}", e.report(false));
            return;
        }
    };
    if std::env::args().nth(2).is_none() {
        println!(
            "{}",
            inspect(&deck, &source).map(|r| r.to_string()).unwrap_or_else(|e| e.to_string())
        );
        return;
    }
    let mut options = Options::new(std::env::args().nth(2).unwrap());
    options.resume = std::env::args().nth(3).is_some();
    match run(&deck, &source, &options, &mut O) {
        Ok(o) => eprintln!("{o:?}"),
        Err(RunFailure::Deck(e)) => eprintln!("{}", e.report(false)),
        Err(e) => eprintln!("{e}"),
    }
}
