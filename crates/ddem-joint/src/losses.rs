//! Energy losses of joints and contacts.

use ddem_mechanics::law::PointLoss;
use ddem_mechanics::math::exact::ExactSum;

/// Losses of the joints of one pack or of contacts, and numbers of failed pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Losses {
    /// Energy dissipated by friction `[J]`.
    pub friction: f64,
    /// Energy dissipated by fracture `[J]`.
    pub fracture: f64,
    /// Numerical loss when contacts form, part and change their points `[J]`.
    pub contact: f64,
    /// Energy dissipated by the dashpots of failed pairs and contacts `[J]`.
    pub damping: f64,
    /// Numbers of pairs that failed in shear and in tension.
    pub failed: [u64; 2],
}

/// Sum of losses over packs or contacts; it does not depend on their order.
#[derive(Clone, Debug, Default)]
pub struct LossSums {
    sums: [ExactSum; 4],
    failed: [u64; 2],
}

impl LossSums {
    pub(super) fn add(&mut self, more: &Losses) {
        let Losses { friction, fracture, contact, damping, failed } = *more;
        let each = [friction, fracture, contact, damping];
        self.sums.iter_mut().zip(each).for_each(|(sum, more)| sum.add(more));
        self.failed = [0, 1].map(|mode| self.failed[mode] + failed[mode]);
    }

    pub(super) fn merge(mut self, other: &Self) -> Self {
        self.sums.iter_mut().zip(&other.sums).for_each(|(sum, more)| sum.merge(more));
        self.failed = [0, 1].map(|mode| self.failed[mode] + other.failed[mode]);
        self
    }

    /// Total losses.
    pub fn total(&self) -> Losses {
        let [friction, fracture, contact, damping] = self.sums.each_ref().map(ExactSum::value);
        Losses { friction, fracture, contact, damping, failed: self.failed }
    }
}

impl<'a> FromIterator<&'a Losses> for LossSums {
    fn from_iter<T: IntoIterator<Item = &'a Losses>>(all: T) -> Self {
        let mut lost = Self::default();
        all.into_iter().for_each(|losses| lost.add(losses));
        lost
    }
}

impl Losses {
    /// Adds the losses of a point with a tributary area `[m²]`.
    pub(super) fn add_point(&mut self, area: f64, loss: PointLoss) {
        self.friction += area * loss.friction;
        self.fracture += area * loss.fracture;
        self.contact += area * loss.contact;
        self.damping += area * loss.damping;
    }

    /// Adds other losses.
    pub fn add(&mut self, more: &Self) {
        self.friction += more.friction;
        self.fracture += more.fracture;
        self.contact += more.contact;
        self.damping += more.damping;
        for (failed, more) in self.failed.iter_mut().zip(more.failed) {
            *failed += more;
        }
    }
}
