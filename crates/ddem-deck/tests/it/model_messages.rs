//! Snapshots of the messages of models, one change of a good deck for each message.

use crate::messages::{DeckEdit, all};

macro_rules! changes {
    ($($name:ident: $changes:expr;)+) => {
        $(
            #[test]
            fn $name() {
                let changes: &[DeckEdit] = &$changes;
                let found = all(changes);
                insta::assert_snapshot!(found);
            }
        )+
    };
}

const SEAM: &str = "joint = 'seam'";
const BASE: &str = "[[fix]]\n        where = { z = 0.0 }\n        axes = 'xyz'";

changes! {
    boundaries: [
        ("", "[[boundary]]\nwhere = { z = 3.0 }\nkind = 'free-field'\n"),
        ("", "[[boundary]]\nwhere = { x = 9.0 }\nkind = 'viscous'\n"),
        ("", "[[boundary]]\nwhere = { x = 1.0 }\nkind = 'viscous'\n"),
        ("", "[[boundary]]\nwhere = { x = 0.0 }\nkind = 'viscous'\n[[boundary]]\nwhere = { x = 0.0 }\nkind = 'viscous'\n"),
        (SEAM, "joint = 'seam'\naxes = [[1, 0, 0], [0.5, 0.8660254, 0], [0.5, 0, 0.8660254]]\n[[boundary]]\nwhere = { side = 'y-' }\nkind = 'free-field'\n"),
        (SEAM, "joint = 'seam'\nbody = 'rigid'\n[[boundary]]\nwhere = { x = 0.0 }\nkind = 'viscous'\n"),
        (SEAM, "joint = 'seam'\naxes = [[2, -1, 2], [2, 2, -1], [-1, 2, 2]]\n[[boundary]]\nwhere = { side = 'z+', z = [2.5, 3.1] }\nkind = 'viscous'\n"),
        (SEAM, "joint = 'seam'\naxes = [[2, -1, 2], [2, 2, -1], [-1, 2, 2]]\n[[load]]\nwhere = { side = 'z+', z = [2.5, 3.1] }\npressure = 1e6\n"),
        (SEAM, "joint = 'seam'\naxes = [[2, -1, 2], [2, 2, -1], [-1, 2, 2]]\n[[load]]\nwhere = { x = 0.0, z = 0.0 }\nline = [0, 0, 1]\n"),
        ("", "[[refine]]\nwhere = { x = [0, 1], z = [1, 2] }\nfactor = 2\n[[boundary]]\nwhere = { x = 0.0 }\nkind = 'free-field'\n"),
        ("where = { z = 0.0 }", "where = { x = 3.0 }\naxes = 'x'\n[[boundary]]\nwhere = { x = 0.0 }\nkind = 'free-field'\n[[fix]]\nwhere = { y = 0.0, x = 3.0 }"),
        (BASE, "[[fix]]\nwhere = { z = 0.0 }\naxes = 'x'\n[[boundary]]\nwhere = { z = 0.0 }\nkind = 'viscous'\n[[stage]]\nname = 'a'\nkind = 'relax'\n"),
    ];
    assignments: [
        ("", "[[assign]]\nwhere = { x = [8, 9] }\njoint = 'seam'\nmaterial = 'rock'\n"),
        ("", "[[assign]]\nwhere = { x = [8, 9] }\njoint = 'seam'\n"),
        ("", "[joints.new]\nnormal_stiffness = 2e10\nshear_stiffness = 1e10\n[[assign]]\nfrom = 'b'\nwhere = { z = [0.9, 1.1] }\njoint = 'new'\n[[stage]]\nname = 'a'\nkind = 'relax'\n[[stage]]\nname = 'b'\nkind = 'relax'\n"),
        ("", "[joints.new]\nnormal_stiffness = 1e10\nshear_stiffness = 1e10\n[[assign]]\nfrom = 'b'\nwhere = { z = [0.9, 1.1] }\njoint = 'new'\n[[stage]]\nname = 'a'\nkind = 'relax'\n[[stage]]\nname = 'b'\nkind = 'relax'\n"),
        ("", "[[blocks]]\nname = 'beside'\norigin = [3, 0, 0]\nsize = [1, 1, 1]\nmaterial = 'rock'\n[[assign]]\nuntil = 'b'\nwhere = { x = [2.9, 3.1] }\njoint = 'seam'\n[[stage]]\nname = 'a'\nkind = 'relax'\n[[stage]]\nname = 'b'\nkind = 'relax'\n[[fix]]\nwhere = { x = 4.0 }\naxes = 'xyz'\n"),
    ];
    thickness_and_size: [
        ("", "[[blocks]]\nsize = [1, 1, 1]\nmaterial = 'rock'\ndivisions = 9\ncount = [130, 130, 130]\norigin = [9, 9, 9]\njoint = 'seam'\n[[blocks]]\nsize = [1, 1, 1]\nmaterial = 'rock'\ndivisions = 9\ncount = [130, 130, 130]\norigin = [19, 9, 9]\njoint = 'seam'\n"),
        ("", "[joints.thick]\nthickness = 0.1\nmaterial = 'rock'\n[[assign]]\nwhere = { x = [0, 1], z = [0.9, 1.1] }\njoint = 'thick'\n"),
        ("cohesion = 1e5", "cohesion = 1e5\nthickness = 0.3\n[[refine]]\nwhere = { z = [2, 3] }\nfactor = 4"),
        ("cohesion = 1e5", "cohesion = 1e5\nthickness = 0.1\n[[refine]]\nwhere = { z = [2, 3] }\nfactor = 4"),
        ("cohesion = 1e5", "cohesion = 1e5\nthickness = 0.1\n[[blocks]]\nname = 'beside'\norigin = [2.5, 0, 0]\nsize = [3, 3, 3]\ncount = [3, 3, 3]\nmaterial = 'rock'\njoint = 'seam'\n"),
        ("", "[[refine]]\nwhere = { cylinder = { from = [0, 0, 0], to = [3, 3, 3], radius = 0.1 } }\nfactor = 400\n"),
    ];
    meshes: [
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 1], [10, 0, 1], [10, 1, 1], [9.3, 1, 1]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7]], blocks = [0] }"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 1], [10, 0, 1], [10, 1, 1], [10, 1, 1]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7]], blocks = [0] }"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 1], [10, 0, 1], [10, 1, 1], [9, 1, 1]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7]], blocks = [0], joints = [{ faces = [[0, 1, 2, 6], [4, 5, 6, 7]], joint = 'seam' }] }\n[[fix]]\nwhere = { set = 'two' }\naxes = 'xyz'"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 1], [10, 0, 1], [10, 1, 1], [9, 1, 1], [9, 0, 4], [10, 0, 4], [10, 1, 4], [9, 1, 4], [9, 0, 5], [10, 0, 5], [10, 1, 5], [9, 1, 5]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7], [8, 9, 10, 11, 12, 13, 14, 15]], blocks = [0, 1], joints = [{ faces = [[0, 1, 2, 3], [12, 13, 14, 15]], joint = 'seam' }] }\n[[fix]]\nwhere = { set = 'two' }\naxes = 'xyz'"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [], hexes = [], blocks = [] }"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7]], blocks = [0, 1] }"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7]], blocks = [0] }"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 1], [10, 0, 1], [10, 1, 1], [9, 1, 1]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7]], blocks = [1] }"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 1], [10, 0, 1], [10, 1, 1], [9, 1, inf]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7]], blocks = [0] }"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 1], [10, 0, 1], [10, 1, 1], [9, 1, 1]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7], [0, 1, 2, 3, 4, 5, 6, 7]], blocks = [0, 1] }"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 1], [10, 0, 1], [10, 1, 1], [9, 1, 1], [9, 0, 2], [10, 0, 2], [10, 1, 2], [9, 1, 2]], hexes = [[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]], blocks = [0, 0] }"),
        (SEAM, "joint = 'seam'\n[[blocks]]\nname = 'two'\nmaterial = 'rock'\nmesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 1], [10, 0, 1], [10, 1, 1], [9, 1, 1]], hexes = [[0, 1, 2, 3, 4, 5, 6, 6]], blocks = [0] }"),
    ];
    stresses_and_rest: [
        ("", "[[blocks]]\nname = 'beside'\norigin = [3, 0, 0]\nsize = [1, 1, 1]\nmaterial = 'rock'\n[[initial]]\nstress = [-1e6, -1e6, -1e6, 0, 0, 0]\n"),
        ("gravity = [0, 0, -10]", "gravity = [3, 0, -10]\n[[initial]]\nstress = [-1e6, -1e6, -1e6, 0, 0, 0]\n"),
        (SEAM, "joint = 'seam'\naxes = [[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]\n[[initial]]\nstress = [-1e6, -1e6, -1e6, 0, 0, 0]\n"),
        ("", "[[blocks]]\nname = 'far'\norigin = [9, 0, 1]\nsize = [1, 1, 1]\nmaterial = 'rock'\n[[stage]]\nname = 'a'\nkind = 'relax'\n"),
        (SEAM, "joint = 'seam'\nbody = 'rigid'\n[[fix]]\nwhere = { x = [9, 10] }\naxes = 'x'"),
        ("", "[contact]\nnormal_stiffness = 3e6\n"),
        ("", "[[remove]]\nfrom = 'dig'\nrelease = 2\nwhere = { z = [2, 3] }\n[[stage]]\nname = 'a'\nkind = 'relax'\n[[stage]]\nname = 'dig'\nkind = 'dynamic'\nduration = 1\n[[stage]]\nname = 'b'\nkind = 'relax'\n"),
        ("gravity = [0, 0, -10]", "contact = false\n[contact]\nfriction = 20\ndamping = 0.2\n"),
        ("friction = 35\n        cohesion = 1e5", "\n[contact]\nfriction = 20\n"),
        ("size = [3, 3, 3]", "size = [3000, 3000, 3000]"),
        ("density = 2400\n        young = 18e9", "density = 2.4\nyoung = 18"),
        ("normal_stiffness = 1e10", "normal_stiffness = 20"),
        ("cohesion = 1e5", "cohesion = 0.5"),
        ("cohesion = 1e5", "cohesion = 1e5\nthickness = 0.02\n[[blocks]]\nname = 'beside'\norigin = [2.999, 0, 0]\nsize = [1, 1, 1]\nmaterial = 'rock'\njoint = 'seam'\n"),
        (SEAM, "joint = 'seam'\n[[remove]]\nwhere = { x = [1, 2], y = [1, 2], z = [1, 3] }\n[[refine]]\nwhere = { z = [2, 3] }\nfactor = 2\n[[charge]]\nwhere = { x = [0.9, 2.1], y = [0.9, 2.1], z = [0.9, 2.0] }\nmass = 500\nexplosive = 'tnt'"),
    ];
}
