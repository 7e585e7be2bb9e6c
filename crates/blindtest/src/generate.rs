//! Generates a case: draws its faults and makes its rig. Which effects, in which place, at which size.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::campaign::{self, WithheldCampaign, WithheldPlan};
use super::conditions::Conditions;
use super::error::BlindError;
use super::family::{Family, SINGLE_SIZES_RAD};
use super::label::{Label, LabelledEffect};
use super::plant_of_pair::plant_of_pair;
use super::size::Baseline;
use riglog::pair;
use rigsim::plant::PlantSpec;
use rigsim::plant::faults::{FAULTS, Fault, FaultRng, Parameters, UNMODELLED_FAULTS, find};

/// Sizes of effects that come together, rad RMS.
const TOGETHER_RAD: (f64, f64) = (12e-6, 60e-6);
/// Sizes of what is outside the library, rad RMS.
const OUTSIDE_RAD: (f64, f64) = (15e-6, 60e-6);
/// A size is met this well.
const TOLERANCE: f64 = 0.04;

/// A case: what was recorded, the pair that its log names, and what was wrong.
pub struct Case {
    /// The recording.
    pub campaign: WithheldCampaign,
    /// The nominal pair.
    pub pair_toml: String,
    /// The draw.
    pub label: Label,
}

/// Sound rigs that were measured before, by the documented compliance of their mesh: most cases share one.
pub type Baselines = Mutex<HashMap<u64, Arc<Baseline>>>;

/// The sound rig of a case, measured once.
fn baseline_of(known: &Baselines, sound: &PlantSpec, plan: &WithheldPlan) -> Result<Arc<Baseline>, BlindError> {
    let key = sound.mesh.compliance_mm2_rad_per_nm.to_bits();
    let found = known.lock().unwrap_or_else(PoisonError::into_inner).get(&key).map(Arc::clone);
    if let Some(baseline) = found {
        return Ok(baseline);
    }
    let baseline = Arc::new(Baseline::measure(sound, plan)?);
    known.lock().unwrap_or_else(PoisonError::into_inner).insert(key, Arc::clone(&baseline));
    Ok(baseline)
}

/// Generates case `number` of the set `seed`: `family` and how many of that family came before it are those of
/// [`super::family::of_case`].
///
/// # Errors
/// [`BlindError`] for a pair without simulated gears, and for an effect that no rig can have at its size.
pub fn generate_case(
    seed: u64,
    number: usize,
    (family, before): (Family, usize),
    pair_toml: &str,
    baselines: &Baselines,
) -> Result<Case, BlindError> {
    // Seeds of neighbouring cases share nothing.
    let mut rng = FaultRng::new(seed ^ (number as u64 + 1).wrapping_mul(0xD134_2543_DE82_EF95));
    let chosen = choose(&mut rng, family, before);
    let size_of = |suffix: &str| {
        let sizes = chosen.iter().filter(|(fault, _)| fault.name.ends_with(suffix)).map(|(_, rms)| *rms);
        sizes.reduce(f64::max)
    };
    let nominal = pair::parse(pair_toml, "pair.toml".as_ref())?;
    let conditions = Conditions::draw(
        &mut rng,
        nominal.errors.mesh_compliance_mm2_rad_per_nm,
        size_of("_interpolation"),
        size_of("mesh_stiffness_variation"),
    );
    let mut sound = plant_of_pair(&nominal)?;
    conditions.apply(&mut sound);
    let plan = WithheldPlan::usual(conditions.rate_hz);

    let mut spec = sound.clone();
    let mut effects = Vec::new();
    let mut rms_rad = 0.0;
    if !chosen.is_empty() {
        let baseline = baseline_of(baselines, &sound, &plan)?;
        let sizing = Sizing { sound: &sound, baseline: &baseline, plan: &plan, seed: conditions.seed };
        for (fault, wanted_rad) in &chosen {
            let (parameters, size_rad) = fit(fault, *wanted_rad, &sizing, &mut rng)?;
            (fault.apply)(&mut spec, &parameters);
            let outside = UNMODELLED_FAULTS.iter().any(|other| other.name == fault.name);
            effects.push(LabelledEffect { name: fault.name.into(), outside, parameters, rms_rad: size_rad });
        }
        rms_rad = match effects.as_slice() {
            [only] => only.rms_rad,
            _ => sizing.rms_rad(&spec, chosen.iter().any(|(fault, _)| fault.develops))?,
        };
    }
    let campaign = campaign::run(&spec, &plan, conditions.seed)?;
    for effect in effects.iter_mut().filter(|effect| effect.name == "count_loss") {
        effect.parameters = effect.parameters.clone().with("steps", campaign.count_losses as f64);
    }
    let exclude = if family == Family::LeftOut {
        let hidden = |fault: &Fault| chosen.iter().any(|(chosen, _)| chosen.is_confusable_with(fault));
        FAULTS.iter().filter(|fault| hidden(fault)).map(|fault| fault.name.to_owned()).collect()
    } else {
        Vec::new()
    };
    let label = Label {
        seed,
        case: number,
        family,
        effects,
        rms_rad,
        exclude,
        white_rad: conditions.white_rad,
        run_out_rad: conditions.run_out_rad,
        rate_hz: conditions.rate_hz,
    };
    Ok(Case { campaign, pair_toml: document(pair_toml, conditions.mesh_compliance_mm2_rad_per_nm), label })
}

/// Which effects, and their sizes.
fn choose(rng: &mut FaultRng, family: Family, before: usize) -> Vec<(&'static Fault, f64)> {
    /// Effects whose trace nothing else in the library resembles.
    const ALONE: [&str; 12] = [
        "time_skew",
        "count_loss",
        "slip",
        "encoder1_interpolation",
        "encoder2_interpolation",
        "tooth_damage",
        "brake_torque_ripple",
        "encoder1_ellipticity",
        "encoder2_ellipticity",
        "pitch_errors",
        "torsional_resonance",
        "profile_error",
    ];
    let several = |rng: &mut FaultRng, count: usize| {
        let mut chosen: Vec<(&'static Fault, f64)> = Vec::new();
        while chosen.len() < count {
            let fault = &FAULTS[rng.below(FAULTS.len())];
            // No analysis could tell confusable faults of one case apart.
            if chosen.iter().all(|(other, _)| !other.is_confusable_with(fault)) {
                chosen.push((fault, rng.spread(TOGETHER_RAD.0, TOGETHER_RAD.1)));
            }
        }
        chosen
    };
    let unknown = |rng: &mut FaultRng| {
        (&UNMODELLED_FAULTS[before % UNMODELLED_FAULTS.len()], rng.spread(OUTSIDE_RAD.0, OUTSIDE_RAD.1))
    };
    match family {
        Family::Null => Vec::new(),
        Family::Single => {
            let (fault, round) = (before % FAULTS.len(), before / FAULTS.len());
            vec![(&FAULTS[fault], SINGLE_SIZES_RAD[(fault + round) % SINGLE_SIZES_RAD.len()])]
        }
        Family::Pair => several(rng, 2),
        Family::Triple => several(rng, 3),
        Family::Outside => vec![unknown(rng)],
        Family::Mixed => {
            let mut chosen = several(rng, 1);
            chosen.push(unknown(rng));
            chosen
        }
        Family::LeftOut => find(ALONE[before % ALONE.len()])
            .map(|fault| (fault, rng.spread(OUTSIDE_RAD.0, OUTSIDE_RAD.1)))
            .into_iter()
            .collect(),
    }
}

/// How sizes are measured in a case.
struct Sizing<'a> {
    sound: &'a PlantSpec,
    baseline: &'a Baseline,
    plan: &'a WithheldPlan,
    seed: u64,
}

impl Sizing<'_> {
    /// What every revolution repeats is measured over one of them.
    fn rms_rad(&self, spec: &PlantSpec, develops: bool) -> Result<f64, BlindError> {
        self.baseline.rms_rad(spec, if develops { self.plan.revolutions } else { 1.0 }, self.seed)
    }
}

/// Draws a fault and scales it to the size wanted; a fault that cannot be as large is as large as it can be.
fn fit(
    fault: &Fault,
    wanted_rad: f64,
    sizing: &Sizing<'_>,
    rng: &mut FaultRng,
) -> Result<(Parameters, f64), BlindError> {
    /// Fresh draws, where one shows nothing.
    const DRAWS: usize = 5;
    /// Corrections of the size.
    const CORRECTIONS: usize = 4;
    /// Steps back from what cannot be built.
    const STEPS_BACK: usize = 40;
    for _ in 0..DRAWS {
        let mut parameters = fault.draw(sizing.sound, rng);
        let mut best = None;
        let mut limited = false;
        for _ in 0..CORRECTIONS {
            let mut measured = None;
            for _ in 0..STEPS_BACK {
                parameters = settled(fault, parameters);
                let mut spec = sizing.sound.clone();
                (fault.apply)(&mut spec, &parameters);
                match sizing.rms_rad(&spec, fault.develops) {
                    Ok(rms_rad) => {
                        measured = Some(rms_rad);
                        break;
                    }
                    Err(BlindError::Plant(_)) => {
                        limited = true;
                        parameters = parameters.scaled(fault.amounts, 0.8);
                    }
                    Err(other) => return Err(other),
                }
            }
            let Some(rms_rad) = measured else { break };
            let miss = (rms_rad / wanted_rad).ln().abs();
            if best.as_ref().is_none_or(|(_, _, least): &(Parameters, f64, f64)| miss < *least) {
                best = Some((parameters.clone(), rms_rad, miss));
            }
            // An amount that shows nothing, as a counter that lost no count, says nothing about another amount.
            if miss < TOLERANCE || (limited && rms_rad < wanted_rad) || rms_rad < 1e-7 {
                break;
            }
            parameters = parameters.scaled(fault.amounts, wanted_rad / rms_rad);
        }
        if let Some((parameters, rms_rad, miss)) = best
            && (limited || miss < 0.5)
        {
            return Ok((parameters, rms_rad));
        }
    }
    Err(BlindError::Unfit { effect: fault.name, rms_rad: wanted_rad })
}

/// Amounts that only come whole.
fn settled(fault: &Fault, parameters: Parameters) -> Parameters {
    if fault.name != "count_loss" {
        return parameters;
    }
    let counts = parameters.number("counts");
    parameters.with("counts", counts.abs().round().max(1.0).copysign(counts))
}

/// The pair's text with the compliance that its gears have.
fn document(pair_toml: &str, mesh_compliance_mm2_rad_per_nm: f64) -> String {
    let Ok(mut table) = pair_toml.parse::<toml::Table>() else { return pair_toml.to_owned() };
    if let Some(toml::Value::Table(documented)) = table.get_mut("documented") {
        documented.insert("mesh_compliance_mm2_rad_per_nm".into(), toml::Value::Float(mesh_compliance_mm2_rad_per_nm));
    }
    toml::to_string(&table).unwrap_or_else(|_| pair_toml.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::of_case;

    #[test]
    fn singles_go_through_every_effect_at_every_size() {
        let mut seen = std::collections::BTreeSet::new();
        for n in 0..4 * FAULTS.len() {
            let chosen = choose(&mut FaultRng::new(1), Family::Single, n);
            assert!(seen.insert((chosen[0].0.name, (chosen[0].1 * 1e7) as u64)));
        }
    }

    #[test]
    fn no_case_holds_what_nobody_can_tell_apart() {
        for n in 0..200 {
            let chosen = choose(&mut FaultRng::new(n), Family::Triple, 0);
            for (k, (fault, _)) in chosen.iter().enumerate() {
                assert!(chosen[..k].iter().all(|(other, _)| !other.is_confusable_with(fault)));
            }
        }
    }

    #[test]
    fn a_drawn_effect_has_its_size_and_the_same_seed_draws_the_same() {
        let (pair_toml, _) = pair::load(None).unwrap();
        let known = Baselines::default();
        let case = generate_case(5, 9, (Family::Single, 9), &pair_toml, &known).unwrap();
        let effect = &case.label.effects[0];
        let wanted = SINGLE_SIZES_RAD[9 % 4];
        assert!((effect.rms_rad / wanted - 1.0).abs() < 2.0 * TOLERANCE, "{} {}", effect.name, effect.rms_rad);
        let again = generate_case(5, 9, (Family::Single, 9), &pair_toml, &known).unwrap();
        assert!(again.label == case.label && again.campaign == case.campaign);
        assert_ne!(
            generate_case(6, 9, of_case(9, Some(Family::Single)), &pair_toml, &known).unwrap().label,
            case.label
        );
    }
}
