//! Polyhedra that have rock in common.

use crate::hull::Hull;
use crate::polyhedron::Polyhedron;
use crate::tree::AxisBox;

/// First two of several polyhedra that have more than a layer of thickness `margin` `[m]` in common.
#[must_use]
pub fn first_overlap(parts: &[Polyhedron], margin: f64) -> Option<[usize; 2]> {
    let boxes: Vec<AxisBox> =
        parts.iter().map(|part| AxisBox::around(part.points.iter())).collect();
    let all = AxisBox::around(parts.iter().flat_map(|part| &part.points));
    let axis = (all.high() - all.low()).imax();
    let low = |part: usize| boxes[part].low()[axis];
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by(|&a, &b| low(a).total_cmp(&low(b)).then(a.cmp(&b)));
    let mut reached: Vec<(usize, Hull)> = Vec::new();
    let mut first: Option<[usize; 2]> = None;
    for number in order {
        let (own, hull) = (&boxes[number], Hull::of_part(&parts[number]));
        reached.retain(|(other, _)| boxes[*other].high()[axis] > low(number) + margin);
        for (other, of_other) in &reached {
            let pair = [number.min(*other), number.max(*other)];
            let earlier = first.is_none_or(|known| pair < known);
            // Boxes that are apart by less than the margin below zero have no such layer.
            if earlier && boxes[*other].overlaps(own, -margin) && !of_other.apart(&hull, margin) {
                first = Some(pair);
            }
        }
        reached.push((number, hull));
    }
    first
}
