//! Keys that may be written in several forms, such as `time_step = "auto"` or seconds.
//!
//! Each form is read by hand. The derived readers try every form; after a mistake they know neither
//! the intended form nor the place of the mistake.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, IgnoredAny, MapAccess, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};

use super::{
    Damping, DiscSizes, Extent, FileOf, History, JointChoice, Plane, SetSpacing, Sheet,
    SurfaceFile, TimeStep,
};

/// Visitor methods for the three types in which a reader passes a number.
macro_rules! numbers {
    ($value:ty, $make:expr) => {
        fn visit_f64<E: Error>(self, number: f64) -> Result<$value, E> {
            Ok($make(number))
        }

        fn visit_i64<E: Error>(self, number: i64) -> Result<$value, E> {
            Ok($make(number as f64))
        }

        fn visit_u64<E: Error>(self, number: u64) -> Result<$value, E> {
            Ok($make(number as f64))
        }
    };
}

impl<'de> Deserialize<'de> for Extent {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ExtentForms;

        impl<'de> Visitor<'de> for ExtentForms {
            type Value = Extent;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number (a plane) or two numbers `[from, to]`")
            }

            numbers!(Extent, Extent::Plane);

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Extent, A::Error> {
                let mut ends = [0.0; 2];
                for (found, end) in ends.iter_mut().enumerate() {
                    *end =
                        seq.next_element()?.ok_or_else(|| Error::invalid_length(found, &self))?;
                }
                let mut found = 2;
                while seq.next_element::<IgnoredAny>()?.is_some() {
                    found += 1;
                }
                if found > 2 {
                    return Err(Error::invalid_length(found, &self));
                }
                Ok(Extent::Range(ends))
            }
        }

        deserializer.deserialize_any(ExtentForms)
    }
}

impl<'de> Deserialize<'de> for Sheet {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct SheetKeys {
            point: Option<[f64; 3]>,
            normal: Option<[f64; 3]>,
            dip: Option<f64>,
            dip_direction: Option<f64>,
            topography: Option<FileOf<SurfaceFile>>,
        }

        struct SheetForms;

        impl<'de> Visitor<'de> for SheetForms {
            type Value = Sheet;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "a level z, a plane `{ point, normal }` or `{ point, dip, dip_direction }`, or \
                     `{ topography = \"file\" }`",
                )
            }

            numbers!(Sheet, Sheet::Level);

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Sheet, A::Error> {
                let SheetKeys { point, normal, dip, dip_direction, topography } =
                    Deserialize::deserialize(MapAccessDeserializer::new(map))?;
                let plane = normal.is_some() || dip.is_some() || dip_direction.is_some();
                match (point, topography) {
                    (None, Some(topography)) if !plane => Ok(Sheet::Topography { topography }),
                    (_, Some(_)) => Err(Error::custom(
                        "`topography` goes without `point`, `normal`, `dip` and `dip_direction`",
                    )),
                    (Some(point), None) => {
                        Ok(Sheet::Plane(Plane { point, normal, dip, dip_direction }))
                    }
                    (None, None) => Err(Error::missing_field("point")),
                }
            }
        }

        deserializer.deserialize_any(SheetForms)
    }
}

impl<'de> Deserialize<'de> for JointChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct ByNormal {
            x: Option<String>,
            y: Option<String>,
            z: Option<String>,
        }

        struct JointChoiceForms;

        impl<'de> Visitor<'de> for JointChoiceForms {
            type Value = JointChoice;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "the name of a joint, or a table of names `{ x = …, y = …, z = … }` by the \
                     direction of the normal",
                )
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<JointChoice, E> {
                Ok(JointChoice::All(name.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<JointChoice, A::Error> {
                let ByNormal { x, y, z } =
                    Deserialize::deserialize(MapAccessDeserializer::new(map))?;
                Ok(JointChoice::ByNormal { x, y, z })
            }
        }

        deserializer.deserialize_any(JointChoiceForms)
    }
}

impl<'de> Deserialize<'de> for SetSpacing {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SpacingForms;

        impl<'de> Visitor<'de> for SpacingForms {
            type Value = SetSpacing;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "a number (the same distance everywhere), `{ mean, spread }` or `{ mean, law, \
                     deviation, least }`",
                )
            }

            numbers!(SetSpacing, SetSpacing::Constant);

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<SetSpacing, A::Error> {
                Deserialize::deserialize(MapAccessDeserializer::new(map)).map(SetSpacing::Random)
            }
        }

        deserializer.deserialize_any(SpacingForms)
    }
}

impl<'de> Deserialize<'de> for DiscSizes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SizeForms;

        impl<'de> Visitor<'de> for SizeForms {
            type Value = DiscSizes;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number (the same radius everywhere) or `{ power, from, to }`")
            }

            numbers!(DiscSizes, DiscSizes::Constant);

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<DiscSizes, A::Error> {
                Deserialize::deserialize(MapAccessDeserializer::new(map)).map(DiscSizes::Power)
            }
        }

        deserializer.deserialize_any(SizeForms)
    }
}

/// Time step of a stage: `"auto"` or seconds.
pub(super) fn time_step<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<TimeStep>, D::Error> {
    struct TimeStepForms;

    impl Visitor<'_> for TimeStepForms {
        type Value = TimeStep;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("`\"auto\"` or a number of seconds")
        }

        numbers!(TimeStep, TimeStep::Seconds);

        fn visit_str<E: Error>(self, word: &str) -> Result<TimeStep, E> {
            match word {
                "auto" => Ok(TimeStep::Auto),
                _ => Err(E::invalid_value(Unexpected::Str(word), &self)),
            }
        }
    }

    deserializer.deserialize_any(TimeStepForms).map(Some)
}

/// Optional factor in time.
pub(super) fn optional_history<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<History>, D::Error> {
    history(deserializer).map(Some)
}

/// Damping of a stage, by its kind.
pub(super) fn damping<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Damping>, D::Error> {
    #[derive(Deserialize)]
    #[serde(field_identifier, rename_all = "lowercase")]
    enum DampingKey {
        Ratio,
        Mass,
        Stiffness,
        Local,
    }

    struct DampingForms;

    impl<'de> Visitor<'de> for DampingForms {
        type Value = Damping;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str(
                "`\"none\"`, `{ ratio = number }`, `{ mass = number }`, `{ stiffness = number }` or \
                 `{ local = number }`",
            )
        }

        fn visit_str<E: Error>(self, word: &str) -> Result<Damping, E> {
            match word {
                "none" => Ok(Damping::None),
                _ => Err(E::invalid_value(Unexpected::Str(word), &self)),
            }
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Damping, A::Error> {
            only_entry(map, &self, |map, key| {
                let number = map.next_value()?;
                Ok(match key {
                    DampingKey::Ratio => Damping::Ratio(number),
                    DampingKey::Mass => Damping::Mass(number),
                    DampingKey::Stiffness => Damping::Stiffness(number),
                    DampingKey::Local => Damping::Local(number),
                })
            })
        }
    }

    deserializer.deserialize_any(DampingForms).map(Some)
}

/// Factor in time, by its kind.
pub(super) fn history<'de, D: Deserializer<'de>>(deserializer: D) -> Result<History, D::Error> {
    #[derive(Deserialize)]
    #[serde(field_identifier, rename_all = "lowercase")]
    enum HistoryKey {
        Ramp,
        Table,
        Duvall,
        Triangle,
    }

    struct HistoryForms;

    impl<'de> Visitor<'de> for HistoryForms {
        type Value = History;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str(
                "`{ ramp = seconds }`, `{ table = [[time, factor], …] }`, `{ duvall = { alpha, \
                 beta } }` or `{ triangle = { rise, fall } }`",
            )
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<History, A::Error> {
            only_entry(map, &self, |map, key| {
                Ok(match key {
                    HistoryKey::Ramp => History::Ramp(map.next_value()?),
                    HistoryKey::Table => History::Table(map.next_value()?),
                    HistoryKey::Duvall => History::Duvall(map.next_value()?),
                    HistoryKey::Triangle => History::Triangle(map.next_value()?),
                })
            })
        }
    }

    deserializer.deserialize_any(HistoryForms)
}

/// Entry of a table that must have exactly one.
fn only_entry<'de, A, K, V>(
    mut map: A,
    expected: &dyn serde::de::Expected,
    read: impl FnOnce(&mut A, K) -> Result<V, A::Error>,
) -> Result<V, A::Error>
where
    A: MapAccess<'de>,
    K: Deserialize<'de>,
{
    let key = map.next_key()?.ok_or_else(|| Error::invalid_length(0, expected))?;
    let value = read(&mut map, key)?;
    let mut found = 1;
    while map.next_key::<K>()?.is_some() {
        map.next_value::<IgnoredAny>()?;
        found += 1;
    }
    if found > 1 {
        return Err(Error::invalid_length(found, expected));
    }
    Ok(value)
}
