//! Explosive charges.

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::{History, Where, forms};

/// A charge: gas that pushes the walls of a cavity, or the two sides of joints, apart
/// (docs/method.md, §11).
///
/// Give exactly one of `mass` (with `explosive`) and `pressure`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Charge {
    /// Walls of cavities left by `[[remove]]`, or joints, by their centres.
    pub r#where: Where,
    /// Mass of the explosive `[kg]`; needed without `pressure`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Explosive: `"tnt"`, `"anfo"`, `"emulsion"`, or `{ density, detonation_velocity, gamma }` in
    /// kg/m³ and m/s; needed with `mass`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explosive: Option<Explosive>,
    /// Peak pressure `[Pa]`; needed without `mass`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<f64>,
    /// Adiabatic index of the gas of a given `pressure`; needed with `"gas"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gamma: Option<f64>,
    /// Decrease of the pressure: `"gas"`, as the cavity grows, or a factor in time; default `"gas"`
    /// with `mass`, constant with `pressure`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub history: Option<ChargeHistory>,
    /// Time of detonation after the start of the stage `from`, otherwise of the run `[s]`;
    /// default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub delay: Option<f64>,
    /// Stage at whose start the entry comes into force; default the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Stage at whose start the entry ends; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
}

/// An explosive, given by its name or by its properties.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Explosive {
    /// Name in the table of docs/method.md, §11.
    Named(String),
    /// Properties of another explosive.
    Given(Detonation),
}

/// Detonation properties of an explosive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Detonation {
    /// Density `[kg/m³]`.
    pub density: f64,
    /// Velocity of detonation `[m/s]`.
    pub detonation_velocity: f64,
    /// Adiabatic index of the gas, above 1.
    pub gamma: f64,
}

/// Pressure history of a charge.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ChargeHistory {
    /// Pressure that depends on the present volume of the cavity.
    Gas(GasWord),
    /// Factor on the pressure, by the time since detonation.
    Given(History),
}

/// The word `"gas"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum GasWord {
    /// Adiabatic expansion.
    Gas,
}

/// Explosives by name.
pub(crate) const EXPLOSIVES: [(&str, Detonation); 3] = [
    ("tnt", Detonation { density: 1630.0, detonation_velocity: 6930.0, gamma: 2.727 }),
    ("anfo", Detonation { density: 850.0, detonation_velocity: 4500.0, gamma: 2.7 }),
    ("emulsion", Detonation { density: 1150.0, detonation_velocity: 5400.0, gamma: 3.0 }),
];

impl Explosive {
    /// Detonation properties; `None` for an unknown name.
    #[must_use]
    pub fn detonation(&self) -> Option<Detonation> {
        match self {
            Self::Given(detonation) => Some(*detonation),
            Self::Named(name) => {
                EXPLOSIVES.iter().find(|(known, _)| known == name).map(|(_, numbers)| *numbers)
            }
        }
    }
}

impl Detonation {
    /// Pressure of detonation `ρ_e D_e²/(2(γ + 1))` `[Pa]`.
    #[must_use]
    pub fn pressure(&self) -> f64 {
        let Self { density, detonation_velocity, gamma } = self;
        density * detonation_velocity * detonation_velocity / (2.0 * (gamma + 1.0))
    }
}

impl Charge {
    /// True if the gas expands, so that the pressure depends on the volume.
    #[must_use]
    pub fn expands(&self) -> bool {
        match self.history {
            Some(ChargeHistory::Gas(_)) => true,
            Some(ChargeHistory::Given(_)) => false,
            None => self.mass.is_some(),
        }
    }

    /// Adiabatic index of the gas, if it is known.
    pub(crate) fn index(&self) -> Option<f64> {
        self.gamma.or_else(|| Some(self.explosive.as_ref()?.detonation()?.gamma))
    }
}

impl<'de> Deserialize<'de> for Explosive {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ExplosiveForms;

        impl<'de> Visitor<'de> for ExplosiveForms {
            type Value = Explosive;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "the name of an explosive, or `{ density = …, detonation_velocity = …, gamma = … \
                     }`",
                )
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<Explosive, E> {
                Ok(Explosive::Named(name.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Explosive, A::Error> {
                Deserialize::deserialize(MapAccessDeserializer::new(map)).map(Explosive::Given)
            }
        }

        deserializer.deserialize_any(ExplosiveForms)
    }
}

impl<'de> Deserialize<'de> for ChargeHistory {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ChargeHistoryForms;

        impl<'de> Visitor<'de> for ChargeHistoryForms {
            type Value = ChargeHistory;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("`\"gas\"`, or a history such as `{ duvall = { alpha, beta } }`")
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<ChargeHistory, E> {
                match word {
                    "gas" => Ok(ChargeHistory::Gas(GasWord::Gas)),
                    _ => Err(E::invalid_value(Unexpected::Str(word), &self)),
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ChargeHistory, A::Error> {
                forms::history(MapAccessDeserializer::new(map)).map(ChargeHistory::Given)
            }
        }

        deserializer.deserialize_any(ChargeHistoryForms)
    }
}
