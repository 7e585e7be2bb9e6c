//! The elastic mesh: exact contact geometry, its drift with temperature, and the stiffness of the teeth.

use super::error::{PlantError, in_range};
use super::flank::Flank;
use super::geometry::GearSpec;
use super::table::{ContactTable, FlankState, Place};
use super::teeth::{ToothSpec, ToothTable};

/// Default compliance of the mesh, mm²·rad/(N·m): 1000/k for k = 5.9e5 N/mm.
pub const DEFAULT_MESH_COMPLIANCE_MM2_RAD_PER_NM: f64 = 1.7e-3;

/// Teeth without compliance are taken as stiff as this, mm²·rad/(N·m): under 0.5 µrad at 10 N·m.
const RIGID_MESH_MM2_RAD_PER_NM: f64 = 1e-4;

/// Stiffness and damping of the teeth in contact.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshSpec {
    /// Compliance of the mesh, mm²·rad/(N·m): 1000/k with the stiffness k along the normal in N/mm; 0 is rigid.
    pub compliance_mm2_rad_per_nm: f64,
    /// Damping in parts of the stiffness, s; contact never pulls.
    pub damping_time_s: f64,
}

impl Default for MeshSpec {
    fn default() -> Self {
        Self { compliance_mm2_rad_per_nm: DEFAULT_MESH_COMPLIANCE_MM2_RAD_PER_NM, damping_time_s: 8e-6 }
    }
}

/// Housing that warms up after the start.
#[derive(Debug, Clone, PartialEq)]
pub struct HousingSpec {
    /// Growth Δa of the centre distance when warm, mm; 0 switches it off.
    pub growth_mm: f64,
    /// Time constant τ of Δa (1 − exp(−t/τ)), s.
    pub time_constant_s: f64,
}

impl Default for HousingSpec {
    fn default() -> Self {
        Self { growth_mm: 0.0, time_constant_s: 300.0 }
    }
}

/// Bearings under the force of the teeth.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BearingSpec {
    /// Compliance of both gears' bearings along the normal, mm/N.
    pub compliance_mm_per_n: f64,
    /// Clearance along the normal, mm: the force of the teeth pushes the gears apart by as much, whatever its size.
    pub clearance_mm: f64,
}

impl BearingSpec {
    pub(super) fn validate(&self) -> Result<(), PlantError> {
        in_range("bearings.compliance_mm_per_n", self.compliance_mm_per_n, "mm/N", (0.0, 0.01), "1e-5 is soft")?;
        in_range("bearings.clearance_mm", self.clearance_mm, "mm", (0.0, 0.5), "0.01 is usual")
    }
}

impl MeshSpec {
    pub(super) fn validate(&self) -> Result<(), PlantError> {
        let compliance = self.compliance_mm2_rad_per_nm;
        in_range("mesh.compliance_mm2_rad_per_nm", compliance, "mm²·rad/(N·m)", (0.0, 10.0), "1000/k with k in N/mm")?;
        in_range("mesh.damping_time_s", self.damping_time_s, "s", (0.0, 1e-3), "damping over stiffness")
    }
}

impl HousingSpec {
    pub(super) fn validate(&self) -> Result<(), PlantError> {
        in_range("housing.growth_mm", self.growth_mm, "mm", (-1.0, 1.0), "growth of the centre distance when warm")?;
        in_range("housing.time_constant_s", self.time_constant_s, "s", (0.1, 1e6), "of the warming")
    }
}

/// The mesh at work.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    cold: ContactTable,
    /// Half warm and warm, where the housing grows.
    warm: Option<Box<[ContactTable; 2]>>,
    /// Weights of cold, half warm and warm: a parabola through exact contact at three centre distances.
    weights: [f64; 3],
    /// Mean compliance of teeth and bearings.
    compliance_mm2_rad_per_nm: f64,
    damping_time_s: f64,
    teeth: Option<ToothTable>,
    clearance_mm: f64,
    /// How far each flank stands back along its normal for clearance and wear, mm.
    recess_mm: f64,
    cos_alpha: f64,
}

impl Mesh {
    pub fn new(
        gears: &GearSpec,
        mesh: &MeshSpec,
        teeth: &ToothSpec,
        bearings: &BearingSpec,
        housing: &HousingSpec,
    ) -> Result<Self, PlantError> {
        let growth_mm = housing.growth_mm;
        let mut cold = ContactTable::new(gears, 0.0, 0)?;
        let mut warm = None;
        if growth_mm != 0.0 {
            // One place must serve all three tables, so they share the finest grid that any of them needs.
            loop {
                let per_turn = cold.cells_per_turn();
                let half_warm = ContactTable::new(gears, 0.5 * growth_mm, per_turn)?;
                let fully_warm = ContactTable::new(gears, growth_mm, half_warm.cells_per_turn())?;
                let finest = fully_warm.cells_per_turn();
                if finest == per_turn {
                    warm = Some(Box::new([half_warm, fully_warm]));
                    break;
                }
                cold = ContactTable::new(gears, 0.0, finest)?;
            }
        }
        Ok(Self {
            cold,
            warm,
            weights: [1.0, 0.0, 0.0],
            // Teeth and bearings in a row: 1 mm/N along the normal is 1000 mm²·rad/(N·m).
            compliance_mm2_rad_per_nm: mesh.compliance_mm2_rad_per_nm + 1e3 * bearings.compliance_mm_per_n,
            damping_time_s: mesh.damping_time_s,
            teeth: ToothTable::new(teeth, gears),
            clearance_mm: bearings.clearance_mm,
            recess_mm: bearings.clearance_mm,
            cos_alpha: gears.pressure_angle_deg.to_radians().cos(),
        })
    }

    /// Sets how much the teeth have worn together, mm along the pitch curve.
    pub fn set_wear(&mut self, wear_mm: f64) {
        // A thinning j opens (j/2) cos α along each normal.
        self.recess_mm = self.clearance_mm + 0.5 * wear_mm * self.cos_alpha;
    }

    /// Sets how warm the housing is: 0 cold, 1 warm.
    pub fn set_warmth(&mut self, x: f64) {
        self.weights = [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)];
    }

    #[inline]
    pub fn locate(&self, theta1: f64) -> Place {
        self.cold.locate(theta1)
    }

    #[inline]
    pub fn inverse_radius(&self, place: Place) -> f64 {
        self.cold.inverse_radius(place)
    }

    #[inline]
    pub fn flank(&self, place: Place, flank: Flank) -> FlankState {
        let cold = self.cold.flank(place, flank);
        let mut at = match &self.warm {
            None => cold,
            Some(warm) => self.blend(cold, warm[0].flank(place, flank), warm[1].flank(place, flank)),
        };
        at.compliance_mm2_rad_per_nm = self.compliance_mm2_rad_per_nm;
        if self.recess_mm != 0.0 {
            at.psi_rad -= flank.sign() * self.recess_mm / at.arm_squared_mm2.sqrt();
        }
        if let Some(teeth) = &self.teeth {
            let tooth = teeth.at(place.theta1_rad, flank);
            at.psi_rad += tooth.psi_rad;
            at.ratio += tooth.ratio;
            at.compliance_mm2_rad_per_nm += tooth.compliance;
        }
        at
    }

    /// K = k (r2 cos(α ∓ μ))², N·m/rad about the driven axis: τ2 = K (ψ − θ2).
    #[inline]
    pub fn stiffness_nm_per_rad(&self, at: &FlankState) -> f64 {
        at.arm_squared_mm2 / at.compliance_mm2_rad_per_nm.max(RIGID_MESH_MM2_RAD_PER_NM)
    }

    #[inline]
    pub fn damping_time_s(&self) -> f64 {
        self.damping_time_s
    }

    fn blend(&self, cold: FlankState, half: FlankState, warm: FlankState) -> FlankState {
        let [a, b, c] = self.weights;
        FlankState {
            psi_rad: a * cold.psi_rad + b * half.psi_rad + c * warm.psi_rad,
            ratio: a * cold.ratio + b * half.ratio + c * warm.ratio,
            arm_squared_mm2: a * cold.arm_squared_mm2 + b * half.arm_squared_mm2 + c * warm.arm_squared_mm2,
            ..cold
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::flank::MountedPair;
    use super::*;

    #[test]
    fn a_warming_housing_passes_through_exact_contact() {
        let gears = GearSpec::default();
        let housing = HousingSpec { growth_mm: 0.06, time_constant_s: 1.0 };
        let (teeth, bearings) = (ToothSpec::default(), BearingSpec::default());
        let mut mesh = Mesh::new(&gears, &MeshSpec::default(), &teeth, &bearings, &housing).unwrap();
        for x in [0.0, 0.2, 0.5, 0.77, 1.0] {
            mesh.set_warmth(x);
            let pair = MountedPair::new(&gears, 0.06 * x);
            for n in 0..40 {
                let theta = f64::from(n) * 0.2;
                for flank in [Flank::Ccw, Flank::Cw] {
                    let got = mesh.flank(mesh.locate(theta), flank).psi_rad;
                    let exact = pair.contact(flank, theta, 0.0).unwrap().psi2_rad;
                    assert!((got - exact).abs() < 1e-9, "{x} {theta}: {}", got - exact);
                }
            }
        }
    }
}
