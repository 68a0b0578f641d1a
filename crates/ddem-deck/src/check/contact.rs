//! Checks of contacts.

use super::{ErrorCode, Faults, Rule};
use crate::schema::ContactTable;
pub(super) fn check(contact: &ContactTable, faults: &mut Faults) {
    let fraction = Rule::Within(0.0, 1.0);
    for (key, value, rule) in [
        ("normal_stiffness", contact.normal_stiffness, Rule::AboveZero),
        ("shear_stiffness", contact.shear_stiffness, Rule::AboveZero),
        ("friction", contact.friction, Rule::From(0.0, 90.0)),
        ("damping", contact.damping, fraction),
        ("restitution", contact.restitution, fraction),
    ] {
        faults.optional(format!("contact.{key}"), value, rule);
    }
    if contact.damping.is_some() && contact.restitution.is_some() {
        faults.add_help(
            ErrorCode::ConflictingKeys,
            "contact.restitution",
            "`restitution` cannot be combined with `damping`",
            "both set the speed lost in a collision: give one of them",
        );
    }
}
