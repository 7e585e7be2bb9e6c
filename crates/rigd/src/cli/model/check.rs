//! `rigd model check`: whether a pair closes, can be cut, keeps its teeth in contact and does not bind.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use gearmodel::contact::ContactModel;
use gearmodel::{Direction, Gear, GearPair};
use serde::Serialize;
use serde_json::json;

use super::curve::{Sampling, points};
use super::error::ModelError;
use super::method::{Method, Predictor};
use super::output::{Output, Report};
use super::source::{Loaded, Source};
use super::table::{Column, Table};
use crate::chart::{Chart, Ink, Mark, Panel, Series};
use crate::cli::Exit;

/// Whether a pair closes, can be cut, keeps its teeth in contact and does not bind.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    #[command(flatten)]
    sampling: Sampling,
    #[command(flatten)]
    output: Output,
}

/// One thing that was looked at.
#[derive(Debug, Clone, Serialize)]
struct Finding {
    /// What.
    name: String,
    /// What it came to, with its unit and place.
    value: String,
    /// What it must be, empty where it only informs.
    limit: String,
    /// Whether it holds.
    ok: bool,
}

impl Finding {
    fn new(name: impl Into<String>, value: String, limit: impl Into<String>, ok: bool) -> Self {
        Self { name: name.into(), value, limit: limit.into(), ok }
    }
}

/// Perimeter and π m Z agree to rounding.
const TOOTH_CONDITION_MM: f64 = 1e-6;

/// Runs the command.
///
/// # Errors
/// [`ModelError`] when there is no such pair; what a pair lacks is a finding and [`Exit::Failed`].
pub fn run(args: &Args) -> Result<Exit, ModelError> {
    args.output.check(&[])?;
    let theta1_rad = args.sampling.angles_rad()?;
    let pair = args.source.load()?;
    let mut findings = kinematics(&pair.model.pair);
    let mut chart = Chart::default();
    if pair.model.pair.has_teeth() {
        findings.extend(teeth(&pair.model.pair, &theta1_rad));
        findings.extend(contact(&pair, &theta1_rad, &mut chart)?);
    }
    for panel in &mut chart.panels {
        panel.x = args.sampling.into();
    }
    let faults: Vec<&Finding> = findings.iter().filter(|finding| !finding.ok).collect();

    // A fault's whole sentence runs over its column instead of widening all.
    let width = |of: fn(&Finding) -> &str| {
        findings.iter().map(|f| of(f).chars().count()).filter(|count| *count < 60).max().unwrap_or(0)
    };
    let (names, values) = (width(|f| &f.name), width(|f| &f.value));
    let mut text = format!("{}\n\n", pair.heading());
    for Finding { name, value, limit, ok } in &findings {
        let verdict = if *ok { "ok   " } else { "FAULT" };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{verdict}  {name:<names$}  {value:<values$}  {limit}");
    }
    let verdict = match faults.len() {
        0 => "no fault".to_owned(),
        1 => "1 fault".to_owned(),
        count => format!("{count} faults"),
    };
    text += &format!("\n{verdict}\n");
    for fault in &faults {
        let limit = if fault.limit.is_empty() { String::new() } else { format!(" ({})", fault.limit) };
        eprintln!("fault: {}: {}{limit}", fault.name, fault.value);
    }
    let exit = if faults.is_empty() { Exit::Done } else { Exit::Failed };
    let json = json!({
        "schema": "rigd.model.check/1",
        "pair": pair.json(),
        "ok": faults.is_empty(),
        "findings": findings,
    });
    let texts = |of: fn(&Finding) -> &str| findings.iter().map(|finding| of(finding).to_owned()).collect();
    let table = Table {
        columns: vec![
            Column::texts("check", texts(|f| &f.name)),
            Column::texts("value", texts(|f| &f.value)),
            Column::texts("limit", texts(|f| &f.limit)),
            Column::texts("verdict", texts(|f| if f.ok { "ok" } else { "fault" })),
        ],
    };
    args.output.deliver(Report { text, json, table, chart }, &[])?;
    Ok(exit)
}

/// Closure, tooth condition and inclination. That the pair was made at all says that it closes; the numbers show it.
fn kinematics(pair: &GearPair) -> Vec<Finding> {
    // A turn of the driver against a turn of f, independent of how the curve states its closure.
    let turned = (pair.theta2(TAU) - pair.theta2(0.0)) / TAU;
    let (z1, z2) = pair.teeth();
    let needed = if pair.has_teeth() { f64::from(z1) / f64::from(z2) } else { pair.closure() };
    let mut findings = vec![Finding::new(
        "closure",
        format!("{turned:.9} turns of the driven gear a turn"),
        format!("{needed:.9} needed"),
        (turned - needed).abs() < 1e-9,
    )];
    if pair.has_teeth() {
        let needed_mm = PI * pair.module_mm() * f64::from(z1);
        findings.push(Finding::new(
            "tooth condition",
            format!("perimeter {:.6} mm", pair.perimeter_mm()),
            format!("π m Z1 = {needed_mm:.6} mm"),
            (pair.perimeter_mm() - needed_mm).abs() < TOOTH_CONDITION_MM,
        ));
        findings.push(Finding::new(
            "centre distance",
            format!("{:.6} mm", pair.centre_distance_mm()),
            "the one that closes",
            true,
        ));
    }
    findings
}

/// Lowest of a function over angles and where: of equals to rounding the first.
fn lowest(theta1_rad: &[f64], value: impl Fn(f64) -> f64) -> (f64, f64) {
    theta1_rad.iter().map(|theta| (value(*theta), *theta)).fold((f64::INFINITY, f64::NAN), |best, one| {
        let clearly = best.0 - one.0 > 1e-9 * one.0.abs();
        if clearly { one } else { best }
    })
}

/// What the rack can cut.
fn teeth(pair: &GearPair, theta1_rad: &[f64]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let alpha = pair.pressure_angle_rad();
    let (steepest, at) = lowest(theta1_rad, |theta| -(alpha + pair.inclination(theta).abs()));
    findings.push(Finding::new(
        "effective pressure angle",
        format!("up to {:.3}° at θ1 = {:.1}°", -steepest.to_degrees(), at.to_degrees()),
        "below 85°",
        // A pair beyond it is refused when it is made.
        true,
    ));
    for gear in [Gear::Driver, Gear::Driven] {
        // By curvature, so that a straight or hollow stretch is no pole.
        let (curvature, at) = lowest(theta1_rad, |theta| -1.0 / pair.curvature_radius_mm(gear, theta));
        let radius_mm = -1.0 / curvature;
        let limit_mm = pair.addendum() * pair.module_mm() / alpha.sin().powi(2);
        findings.push(Finding::new(
            format!("sharpest curvature, gear {}", gear.number()),
            format!("radius {radius_mm:.3} mm at θ1 = {:.1}°", at.to_degrees()),
            format!("no undercut from {limit_mm:.3} mm"),
            radius_mm >= limit_mm,
        ));
    }
    let faults = pair.tooth_faults();
    if faults.is_empty() {
        let passed = "convex, not undercut, not pointed, no interference";
        findings.push(Finding::new("cutting by a rack", passed.into(), "", true));
    }
    findings.extend(faults.iter().map(|fault| Finding::new("cutting by a rack", fault.to_string(), "", false)));
    findings
}

/// Contact ratio, pairs in contact, and backlash with the documented errors.
fn contact(loaded: &Loaded, theta1_rad: &[f64], chart: &mut Chart) -> Result<Vec<Finding>, ModelError> {
    let pair = &loaded.model.pair;
    let model = ContactModel::new(pair.clone(), &loaded.model.errors)
        .map_err(|source| ModelError::Geometry { pair: loaded.name.clone(), source })?;
    let mut findings = Vec::new();
    let mut series = Vec::new();
    for (direction, ink) in Direction::BOTH.into_iter().zip([Ink::Ccw, Ink::Cw]) {
        let ratios: Vec<f64> = (0..pair.teeth().0).map(|tooth| model.contact_ratio(tooth, direction)).collect();
        let (low, high) = ratios.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), r| (low.min(*r), high.max(*r)));
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        findings.push(Finding::new(
            format!("contact ratio, {direction}"),
            format!("{low:.3} to {high:.3}, mean {mean:.3}"),
            "above 1",
            low > 1.0,
        ));
        let mut lost = None;
        let mut fewest = u32::MAX;
        let mut pairs = Vec::new();
        for theta in theta1_rad {
            match model.contact(*theta, direction) {
                Ok(contact) => {
                    fewest = fewest.min(contact.pairs_in_zone);
                    pairs.push((theta.to_degrees(), f64::from(contact.pairs_in_zone)));
                }
                Err(error) => {
                    lost.get_or_insert(error);
                }
            }
        }
        series.push(Series { name: direction.to_string(), ink, mark: Mark::Line, points: pairs });
        findings.push(match lost {
            None => Finding::new(
                format!("tooth pairs in contact, {direction}"),
                format!("at least {fewest}"),
                "at least 1",
                true,
            ),
            Some(error) => {
                Finding::new(format!("tooth pairs in contact, {direction}"), error.to_string(), "at least 1", false)
            }
        });
    }
    chart.panels.push(Panel::over_turn("Tooth pairs in contact", "pairs", series));

    let predictor = Predictor::new(loaded, Method::CommonNormal, 0.0)?;
    let backlash = theta1_rad.iter().map(|theta| predictor.backlash_rad(*theta)).collect::<Result<Vec<_>, _>>()?;
    let (least_mm, at) = theta1_rad
        .iter()
        .zip(&backlash)
        .map(|(theta, value)| (value * pair.driven_radius(*theta), *theta))
        .fold((f64::INFINITY, f64::NAN), |best, one| if one.0 < best.0 { one } else { best });
    findings.push(Finding::new(
        "backlash with documented errors",
        format!("least {:.1} µm at θ1 = {:.1}°", least_mm * 1e3, at.to_degrees()),
        "0 or more: below it the teeth bind; backlash_mm or the centre distance gives room",
        // A pair without errors and backlash has exactly none.
        least_mm > -1e-9,
    ));
    chart.panels.push(Panel::over_turn(
        "Backlash at the driven shaft, documented errors, no load",
        "backlash / µrad",
        vec![Series {
            name: "backlash".into(),
            ink: Ink::Backlash,
            mark: Mark::Line,
            points: points(theta1_rad, &backlash),
        }],
    ));
    Ok(findings)
}
