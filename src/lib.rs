//! Deformable block discrete element method for jointed rock.

pub use ddem_core::*;
pub use ddem_io as io;
