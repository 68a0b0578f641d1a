//! Valid values of keys, and the keys and words that other programs use for those of a deck.

/// Valid value of each key for a message, by the key or by its section and key.
const VALUES: &[(&str, &str)] = &[
    ("at", "[0.5, 0.5, 1.0]"),
    ("blocks.axes", "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"),
    ("bracket", "[0.5, 4.0]"),
    ("centre", "[0.0, 0.0, 0.0]"),
    ("checkpoint_every", "60"),
    ("cohesion", "1e6"),
    ("contact.damping", "0.2"),
    ("count", "[4, 1, 1]"),
    ("delay", "0.01"),
    ("density", "2600"),
    ("detonation_velocity", "5000"),
    ("deviation", "0.8"),
    ("dfn.size", "1.5"),
    ("dip", "45"),
    ("dip_direction", "90"),
    ("displacement", "[0.0, 0.0, -0.01]"),
    ("divisions", "2"),
    ("duration", "0.5"),
    ("every", "1e-3"),
    ("every_steps", "10"),
    ("factor", "2"),
    ("fields_every", "0.01"),
    ("fisher", "50"),
    ("fix.axes", "\"xyz\""),
    ("force", "[0.0, 0.0, -1e6]"),
    ("fracture_energy", "[50.0, 200.0]"),
    ("frames", "20"),
    ("friction", "35"),
    ("gamma", "3.0"),
    ("gravity", "[0.0, 0.0, -9.81]"),
    ("increments", "10"),
    ("jcs", "50e6"),
    ("jrc", "10"),
    ("least", "0.1"),
    ("limit", "0.02"),
    ("line", "[0.0, 0.0, -1e5]"),
    ("mass", "1.5"),
    ("material", "\"rock\""),
    ("max_steps", "200000"),
    ("mean", "2.0"),
    ("normal", "[0, 0, 1]"),
    ("normal_stiffness", "1e10"),
    ("number", "300"),
    ("origin", "[0.0, 0.0, 0.0]"),
    ("p32", "0.8"),
    ("persistence", "0.8"),
    ("point", "[0.0, 0.0, 1.0]"),
    ("poisson", "0.25"),
    ("power", "3.5"),
    ("pressure", "1e6"),
    ("radius", "0.2"),
    ("ramp", "0.1"),
    ("region.north", "[0, 1, 0]"),
    ("release", "0.1"),
    ("resolution", "0.005"),
    ("restitution", "0.5"),
    ("shear_stiffness", "1e10"),
    ("size", "[4.0, 1.0, 1.0]"),
    ("spacing", "2.0"),
    ("spin", "[0.0, 0.0, 1.0]"),
    ("spread", "0.6"),
    ("stress", "[-1e6, -1e6, -2e6, 0, 0, 0]"),
    ("tension", "1e6"),
    ("thickness", "0.01"),
    ("through", "[12.0, 20.0, 15.0]"),
    ("time_step", "\"auto\""),
    ("tolerance", "1e-5"),
    ("traction", "[0.0, 0.0, -1e6]"),
    ("velocity", "[0.0, 0.0, -0.1]"),
    ("where", "{ z = 0.0 }"),
    ("width", "0.2"),
    ("within", "10"),
    ("young", "20e9"),
];

/// Symbols and words, in lower case, each with the key or word of a deck that it probably means.
const MEANT: &[(&str, &str)] = &[
    ("c", "cohesion"),
    ("dt", "time_step"),
    ("e", "young"),
    ("equilibrium", "relax"),
    ("explicit", "dynamic"),
    ("fos", "safety"),
    ("g", "gravity"),
    ("kn", "normal_stiffness"),
    ("ks", "shear_stiffness"),
    ("nu", "poisson"),
    ("phi", "friction"),
    ("psi", "dilation"),
    ("quasi-static", "relax"),
    ("rho", "density"),
    ("srf", "safety"),
    ("static", "relax"),
    ("strength-reduction", "safety"),
    ("transient", "dynamic"),
    ("ν", "poisson"),
    ("ρ", "density"),
    ("φ", "friction"),
    ("ψ", "dilation"),
];

/// A key with a valid value, such as `poisson = 0.25`, for the place of a fault. `None` if no value
/// is known.
pub(crate) fn example(place: &str) -> Option<String> {
    let plain = |part: &str| part.split('[').next().unwrap_or_default().to_owned();
    let mut parts = place.rsplit('.').map(plain);
    let key = parts.next()?;
    let table = parts.next().unwrap_or_default();
    let section = parts.next_back().unwrap_or_else(|| table.clone());
    let find = |name: &str| VALUES.iter().find(|(known, _)| *known == name);
    let within = |above: &str| find(&format!("{above}.{key}"));
    let (_, value) = within(&table).or_else(|| within(&section)).or_else(|| find(&key))?;
    Some(format!("{key} = {value}"))
}

/// Known key or word that a symbol of the field, or a word of another program, means.
pub(crate) fn meant<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    let (_, meant) = MEANT.iter().find(|(written, _)| *written == word)?;
    known.into_iter().find(|known| known == meant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::section_keys;

    #[test]
    fn examples_are_toml() {
        assert!(VALUES.is_sorted() && MEANT.is_sorted());
        for (key, value) in VALUES {
            let text = format!("{key} = {value}");
            assert!(text.parse::<toml::Table>().is_ok(), "{text}");
        }
    }

    /// A key of the deck, or a word of one of its keys, that is gone from the schema is found here.
    #[test]
    fn keys_and_words_are_those_of_the_schema() {
        let schema = crate::json_schema().to_string();
        for (name, _) in VALUES {
            match name.split_once('.') {
                Some((section, key)) => {
                    let table = schema.contains(&format!("\"{section}\":{{"))
                        && schema.contains(&format!("\"{key}\":{{"));
                    assert!(section_keys(section).contains(&key) || table, "{name}");
                }
                None => assert!(schema.contains(&format!("\"{name}\":{{")), "{name}"),
            }
        }
        for (word, meant) in MEANT {
            assert!(schema.contains(&format!("\"{meant}\"")), "{word}: {meant}");
        }
    }

    #[test]
    fn example_is_that_of_the_section() {
        let is = |place: &str, text: &str| assert_eq!(example(place).as_deref(), Some(text));
        is("fix[0].axes", "axes = \"xyz\"");
        is("blocks[1].axes[2][0]", "axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]");
        is("materials.\"soft rock\".poisson", "poisson = 0.25");
        is("model.gravity[2]", "gravity = [0.0, 0.0, -9.81]");
        assert_eq!(example("stage[0].name"), None);
        assert_eq!(example(""), None);
    }

    #[test]
    fn symbols_mean_keys_that_exist() {
        assert_eq!(meant("E", ["density", "young"]), Some("young"));
        assert_eq!(meant("static", ["relax", "dynamic"]), Some("relax"));
        assert_eq!(meant("E", ["density"]), None);
    }
}
