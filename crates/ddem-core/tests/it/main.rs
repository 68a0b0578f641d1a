//! Properties of the method, checked on whole models through the public interface.
//!
//! Several tests print what they measure: `cargo test -p ddem-core --test it -- --nocapture`.

#![allow(clippy::disallowed_methods, clippy::print_stdout)]

mod architecture;
mod arrays;
mod blasts;
mod boundaries;
mod cavities;
mod charges;
mod collisions;
mod compiler;
mod contact_onset;
mod contact_output;
mod corotation;
mod damage;
mod decks;
mod determinism;
mod embedded;
mod equations;
mod excavated_contacts;
mod excavation;
mod exposed_faces;
mod failing_places;
mod filling;
mod fragments;
mod in_situ;
mod increments;
mod initial_stress_supports;
mod interfaces;
mod joint_charges;
mod joint_failure;
mod mechanisms;
mod messages;
mod mixture;
mod nonconforming;
mod peaks;
mod programs;
mod random_models;
mod refine;
mod relaxation_steps;
mod resume;
mod rigid;
mod rotated_joints;
mod searches;
mod sliding_friction;
mod stage_properties;
mod stages;
mod sudden_starts;
mod thin_joints;
mod tiling;
mod tumbling;
mod unbonded_blocks;
