//! Access to the keys of a table, the entries of an array and the words of a choice.

use serde::de::value::{StrDeserializer, UnitDeserializer};
use serde::de::{DeserializeSeed, EnumAccess, Error, IntoDeserializer, MapAccess, SeqAccess};
use serde::de::{Unexpected, VariantAccess, Visitor};
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::mistake::Mistake;
use super::{Pick, Reader};

type Entry<'a> = (&'a Spanned<DeString<'a>>, &'a Spanned<DeValue<'a>>);

/// The keys of a table.
pub(super) struct Keys<'a, 'r> {
    table: &'r Reader<'a>,
    /// Remaining entries, the next one last.
    left: Vec<Entry<'a>>,
    value: Option<Reader<'a>>,
}

impl<'a, 'r> Keys<'a, 'r> {
    /// Keys of a table. With a list of known keys the others are recorded as mistakes and left out.
    pub(super) fn new(
        table: &'r Reader<'a>,
        keys: &'a DeTable<'a>,
        known: Option<&'static [&'static str]>,
    ) -> Self {
        let picked = |key: &str| match table.picks.first() {
            Some(Pick::Key(pick)) => *pick == key,
            _ => true,
        };
        let mut left: Vec<Entry<'a>> =
            keys.iter().filter(|(key, _)| picked(key.get_ref())).collect();
        left.reverse();
        if let Some(known) = known {
            left.retain(|(key, value)| {
                let is_known = known.contains(&key.get_ref().as_ref());
                if !is_known {
                    let mistake = Mistake::unknown_field(key.get_ref(), known);
                    let place = table.key(key.get_ref(), value).place;
                    table.unknown.borrow_mut().push(mistake.at_key(place, key.span()));
                }
                is_known
            });
        }
        Self { table, left, value: None }
    }
}

impl<'a> MapAccess<'a> for Keys<'a, '_> {
    type Error = Mistake;

    fn next_key_seed<K: DeserializeSeed<'a>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Mistake> {
        let Some((key, value)) = self.left.pop() else { return Ok(None) };
        let reader = self.table.key(key.get_ref(), value);
        let name: StrDeserializer<'_, Mistake> = key.get_ref().as_ref().into_deserializer();
        let name =
            seed.deserialize(name).map_err(|m| m.at_key(reader.place.clone(), key.span()))?;
        self.value = Some(reader);
        Ok(Some(name))
    }

    fn next_value_seed<V: DeserializeSeed<'a>>(&mut self, seed: V) -> Result<V::Value, Mistake> {
        let value = self.value.take();
        seed.deserialize(value.ok_or_else(|| Mistake::custom("misused reader"))?)
    }
}

/// The entries of an array.
pub(super) struct Entries<'a, 'r> {
    array: &'r Reader<'a>,
    values: &'a [Spanned<DeValue<'a>>],
    next: usize,
}

impl<'a, 'r> Entries<'a, 'r> {
    pub(super) fn new(array: &'r Reader<'a>, values: &'a [Spanned<DeValue<'a>>]) -> Self {
        Self { array, values, next: 0 }
    }
}

impl<'a> SeqAccess<'a> for Entries<'a, '_> {
    type Error = Mistake;

    fn next_element_seed<T: DeserializeSeed<'a>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Mistake> {
        if let Some(Pick::Entry(pick)) = self.array.picks.first() {
            self.next = self.next.max(*pick);
            if self.next > *pick {
                return Ok(None);
            }
        }
        let Some(value) = self.values.get(self.next) else { return Ok(None) };
        let entry = self.array.entry(self.next, value);
        self.next += 1;
        seed.deserialize(entry).map(Some)
    }
}

/// A choice, written as a word.
pub(super) struct Variant<'a>(pub(super) &'a str);

impl<'de> EnumAccess<'de> for Variant<'_> {
    type Error = Mistake;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), Mistake> {
        let word: StrDeserializer<'_, Mistake> = self.0.into_deserializer();
        Ok((seed.deserialize(word)?, self))
    }
}

/// Choices with values have readers of their own in `schema`, so here a choice is only a word.
impl<'de> VariantAccess<'de> for Variant<'_> {
    type Error = Mistake;

    fn unit_variant(self) -> Result<(), Mistake> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Mistake> {
        seed.deserialize(UnitDeserializer::new())
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Mistake> {
        Err(Mistake::invalid_value(Unexpected::Str(self.0), &visitor))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mistake> {
        Err(Mistake::invalid_value(Unexpected::Str(self.0), &visitor))
    }
}
