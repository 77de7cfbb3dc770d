//! Every model against closed forms, against one another, and what it costs.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod bead_pair;
mod chain_conservation;
mod chain_exact;
mod chain_finite_body;
mod chain_scale;
mod chain_steppers;
mod effects_costs;
mod effects_files;
mod effects_work;
mod fea_bench;
mod fea_bodies;
mod fea_contact;
mod fea_convergence;
mod fea_elements;
mod fea_factor;
mod fea_gmsh;
mod fea_mesh;
mod fea_modes;
mod fea_resume;
mod fea_statics;
mod fea_stress;
mod fea_transient;
mod reduced_conservation;
mod reduced_effects;
mod reduced_fea;
mod reduced_side_by_side;
mod response_field;
mod water_agreement;
mod water_chain;
mod water_disc;
mod water_elements;
mod water_field;
mod water_fronts;
mod water_rayleigh;
mod water_scene;
