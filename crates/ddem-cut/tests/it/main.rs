//! Tests of the cutter. Exact values come from counting planes, lines and points, from closed forms
//! and from integrals over surfaces.

mod arrangements;
mod degenerate;
mod fractures;
mod grounds;
mod hexes;
mod properties;
mod random_cuts;
mod scale;
mod sets;
mod shapes;
mod shared;
mod stability;
mod tunnels;
mod voronoi;
mod wedges;
