//! Linear isotropic elasticity.

/// Lamé constants and density of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// First Lamé constant λ `[Pa]`.
    pub lambda: f64,
    /// Shear modulus G `[Pa]`.
    pub shear: f64,
    /// Density ρ `[kg/m³]`.
    pub density: f64,
}

impl Elastic {
    /// Constants from density `[kg/m³]`, Young's modulus `[Pa]` and Poisson's ratio:
    /// `λ = Eν/((1+ν)(1−2ν))`, `G = E/(2(1+ν))`.
    #[must_use]
    pub fn new(density: f64, young: f64, poisson: f64) -> Self {
        Self {
            lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            shear: young / (2.0 * (1.0 + poisson)),
            density,
        }
    }

    /// Modulus of uniaxial strain `M = λ + 2G` `[Pa]`.
    #[must_use]
    pub fn p_modulus(&self) -> f64 {
        self.lambda + 2.0 * self.shear
    }

    /// Speed of compression waves `c_P = √((λ+2G)/ρ)` `[m/s]`.
    #[must_use]
    pub fn p_speed(&self) -> f64 {
        (self.p_modulus() / self.density).sqrt()
    }

    /// Speed of shear waves `c_S = √(G/ρ)` `[m/s]`.
    #[must_use]
    pub fn s_speed(&self) -> f64 {
        (self.shear / self.density).sqrt()
    }

    /// Elastic matrix D `[Pa]`, shape `(6, 6)`, for strains xx yy zz xy yz zx with engineering
    /// shears, eq. (5).
    #[doc(alias = "eq 5")]
    #[must_use]
    pub fn matrix(&self) -> [[f64; 6]; 6] {
        let mut d = [[0.0; 6]; 6];
        for i in 0..3 {
            d[i][..3].fill(self.lambda);
            d[i][i] = self.p_modulus();
            d[i + 3][i + 3] = self.shear;
        }
        d
    }

    /// Stress xx yy zz xy yz zx `[Pa]` from the displacement gradient `∂u_i/∂x_k`, shape `(3, 3)`.
    #[must_use]
    pub fn stress(&self, gradient: &[[f64; 3]; 3]) -> [f64; 6] {
        let g = gradient;
        let volume = self.lambda * (g[0][0] + g[1][1] + g[2][2]);
        let axial = |i: usize| volume + 2.0 * self.shear * g[i][i];
        let shear = |i: usize, k: usize| self.shear * (g[i][k] + g[k][i]);
        [axial(0), axial(1), axial(2), shear(0, 1), shear(1, 2), shear(2, 0)]
    }
}
