//! Factors that a search for the factor of safety tries.

use super::SafetyTrial;
use crate::model::stage::SafetySearch;
use crate::state::watch::Verdict;

/// Largest factor by which strengths are reduced at once. Many pairs that fail together release
/// energy, which makes others fail that would hold.
pub(super) const RUNG: f64 = 1.05;

/// Factors above the lowest one of a search, or above 1 if that is less, up to the highest one. Each
/// is at most [`RUNG`] times the one before.
pub(super) fn rungs(search: &SafetySearch) -> Vec<f64> {
    let [low, high] = search.bracket;
    let rungs = (1..).map(|rung| low.max(1.0) * libm::pow(RUNG, f64::from(rung)));
    rungs.take_while(|&factor| factor < high).chain([high]).collect()
}

/// Two factors that divide a bracket in three equal ratios; `None` if it is narrow enough, or too narrow
/// for two numbers between its ends.
pub(super) fn thirds([stable, unstable]: [f64; 2], resolution: f64) -> Option<[f64; 2]> {
    let ratio = unstable / stable;
    let [low, high] = [1.0, 2.0].map(|third| stable * libm::pow(ratio, third / 3.0));
    let divides = unstable - stable > resolution && stable < low && low < high && high < unstable;
    divides.then_some([low, high])
}

/// Largest number of trials that narrow a bracket to a resolution: the upper third is the widest.
fn narrowing(bracket: [f64; 2], resolution: f64) -> u64 {
    let next = thirds(bracket, resolution);
    next.map_or(0, |[_, upper]| 2 + narrowing([upper, bracket[1]], resolution))
}

/// Largest number of trials of a search, if some are `known`.
#[must_use]
pub fn most_trials(search: &SafetySearch, known: &[SafetyTrial]) -> u64 {
    let (rungs, resolution) = (rungs(search), search.resolution);
    let is_stable = |factor: f64| {
        let trial = known.iter().find(|trial| trial.factor == factor)?;
        Some(trial.verdict == Verdict::AtRest)
    };
    let below = |rung: usize| rung.checked_sub(1).map_or(search.bracket[0], |below| rungs[below]);
    let unstable = rungs.iter().position(|&rung| is_stable(rung) == Some(false));
    if is_stable(search.bracket[0]) == Some(false) {
        return known.len() as u64;
    }
    let Some(rung) = unstable else {
        let at = |rung: usize| 2 + rung as u64 + narrowing([below(rung), rungs[rung]], resolution);
        let first = rungs.iter().position(|&rung| is_stable(rung).is_none()).unwrap_or(0);
        return (first..rungs.len()).map(at).max().unwrap_or(0);
    };
    let (mut trials, mut bracket) = (2 + rung as u64, [below(rung), rungs[rung]]);
    while let Some([low, high]) = thirds(bracket, resolution) {
        let (Some(first), Some(second)) = (is_stable(low), is_stable(high)) else { break };
        bracket = match (first, second) {
            (false, _) => [bracket[0], low],
            (true, false) => [low, high],
            (true, true) => [high, bracket[1]],
        };
        trials += 2;
    }
    trials + narrowing(bracket, resolution)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(bracket: [f64; 2]) -> SafetySearch {
        SafetySearch { bracket, ..SafetySearch::default() }
    }

    /// Number of trials of a search whose factors are stable below a limit, after each of which the
    /// largest number is not too low.
    fn count(search: &SafetySearch, limit: f64) -> u64 {
        let mut known: Vec<SafetyTrial> = Vec::new();
        let mut add = |factor: f64| {
            let rests = factor < limit;
            let verdict = if rests { Verdict::AtRest } else { Verdict::Fails };
            known.push(SafetyTrial { factor, verdict, steps: 9 });
            rests
        };
        let [low, high] = search.bracket;
        add(low);
        let unstable = rungs(search).into_iter().find(|&rung| !add(rung)).unwrap_or(high);
        let below = rungs(search).into_iter().filter(|&rung| rung < unstable).fold(low, f64::max);
        let mut bracket = [below, unstable];
        while let Some([first, second]) = thirds(bracket, search.resolution) {
            bracket = match (add(first), add(second)) {
                (false, _) => [bracket[0], first],
                (true, false) => [first, second],
                (true, true) => [second, bracket[1]],
            };
        }
        let all = known.len() as u64;
        let mut most = most_trials(search, &[]);
        for done in 1..=known.len() {
            let now = most_trials(search, &known[..done]);
            assert!(all <= now && now <= most, "{all} trials, {most} then {now} after {done}");
            most = now;
        }
        assert_eq!(most, all, "nothing is left");
        all
    }

    #[test]
    fn largest_number_of_trials_is_never_too_low() {
        for bracket in [[0.5, 4.0], [1.0, 3.0], [0.8, 3.0], [1.0, 1.103], [1.0, 1.004], [1.3, 2.0]]
        {
            let [low, high] = bracket;
            let limits = (1..2000).map(|i| low + (high - low) * f64::from(i) / 2000.0);
            let counts = limits.map(|limit| count(&search(bracket), limit));
            assert_eq!(counts.max(), Some(most_trials(&search(bracket), &[])), "{bracket:?}");
        }
    }

    #[test]
    fn rungs_rise_from_the_lowest_factor_or_1_to_the_highest() {
        assert_eq!(rungs(&search([0.5, 1.1])), [1.05, 1.1]);
        assert_eq!(rungs(&search([2.0, 2.11])), [2.1, 2.11]);
        assert_eq!(rungs(&search([0.5, 0.9])), [0.9]);
    }
}
