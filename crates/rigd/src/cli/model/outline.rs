//! `rigd model outline`: the gears as drawings.

use std::path::{Path, PathBuf};

use gearmodel::{Gear, Outline};
use serde_json::json;

use super::error::OutputError;
use super::error::{ModelError, check_count};
use super::output::{Extra, Output, Report};
use super::source::Source;
use super::table::{Column, Table};
use crate::chart::{Axis, Chart, Ink, Mark, Panel, Scale, Series};
use crate::quantity::ANGLE;

/// The gears as drawings.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    /// Which gear; with both, FILE.dxf becomes FILE-1.dxf and FILE-2.dxf
    #[arg(long, value_enum, default_value = "both")]
    gear: Which,
    /// Points a tooth
    #[arg(long, default_value_t = 60, value_name = "N")]
    points_per_tooth: u32,
    /// Where --plot shows the gears in mesh, as `30deg`
    #[arg(long, default_value = "0deg", allow_hyphen_values = true)]
    theta1: String,
    /// Write a DXF drawing in mm, a closed polyline a gear (`-` is stdout)
    #[arg(long, value_name = "FILE")]
    dxf: Option<PathBuf>,
    /// Write an SVG drawing in mm, to scale (`-` is stdout)
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

/// Which gear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Which {
    /// The driver
    #[value(name = "1")]
    Driver,
    /// The driven gear
    #[value(name = "2")]
    Driven,
    /// Both
    Both,
}

impl Which {
    fn list(self) -> &'static [Gear] {
        match self {
            Self::Driver => &[Gear::Driver],
            Self::Driven => &[Gear::Driven],
            Self::Both => &[Gear::Driver, Gear::Driven],
        }
    }
}

/// Runs the command.
///
/// # Errors
/// [`ModelError`] when the teeth cannot be cut, with the angle and the limit.
pub fn run(args: &Args) -> Result<(), ModelError> {
    args.output.check(&[("--dxf", args.dxf.as_deref()), ("--svg", args.svg.as_deref())])?;
    for (option, path) in [("--dxf", &args.dxf), ("--svg", &args.svg)] {
        if args.gear == Which::Both && path.as_deref() == Some(Path::new("-")) {
            return Err(OutputError::TwoGears { option }.into());
        }
    }
    let points_per_tooth = check_count("--points-per-tooth", args.points_per_tooth.into(), (12, 10_000))? as usize;
    let theta1_rad = ANGLE.parse(&args.theta1)?;
    let loaded = args.source.load()?;
    let pair = &loaded.model.pair;
    let geometry = |source| ModelError::Geometry { pair: loaded.name.clone(), source };
    let gears = args
        .gear
        .list()
        .iter()
        .map(|gear| pair.outline(*gear, points_per_tooth).map(|outline| (*gear, outline)))
        .collect::<Result<Vec<_>, _>>()
        .map_err(geometry)?;

    let mut extras = Vec::new();
    for (gear, outline) in &gears {
        let number = gear.number();
        let path = |path: &Path| if gears.len() > 1 { numbered(path, number) } else { path.to_owned() };
        if let Some(file) = &args.dxf {
            let content = outline.to_dxf(&format!("GEAR{number}")).into_bytes();
            extras.push(Extra { option: "--dxf", path: path(file), content });
        }
        if let Some(file) = &args.svg {
            extras.push(Extra { option: "--svg", path: path(file), content: outline.to_svg().into_bytes() });
        }
    }

    let mut text = format!("{}\n", loaded.heading());
    for (gear, outline) in &gears {
        let (root_mm, tip_mm) = radii_mm(outline);
        text += &format!(
            "\ngear {}: {} teeth, {} points\n  from the axis  {root_mm:.4} to {tip_mm:.4} mm\n  area           {:.3} mm²\n",
            gear.number(),
            if *gear == Gear::Driver { pair.teeth().0 } else { pair.teeth().1 },
            outline.points_mm.len(),
            outline.area_mm2()
        );
    }
    for extra in &extras {
        text += &format!("\n{} {}", extra.option.trim_start_matches('-'), extra.path.display());
    }
    let json = json!({
        "schema": "rigd.model.outline/1",
        "pair": loaded.json(),
        "gears": gears.iter().map(|(gear, outline)| {
            let (root_mm, tip_mm) = radii_mm(outline);
            json!({
                "gear": gear.number(),
                "points": outline.points_mm.len(),
                "area_mm2": outline.area_mm2(),
                "least_radius_mm": root_mm,
                "largest_radius_mm": tip_mm,
            })
        }).collect::<Vec<_>>(),
        "files": extras.iter().map(|extra| extra.path.display().to_string()).collect::<Vec<_>>(),
    });
    let all = || gears.iter().flat_map(|(gear, outline)| outline.points_mm.iter().map(|point| (gear.number(), *point)));
    let table = Table {
        columns: vec![
            Column::numbers("gear", all().map(|(gear, _)| f64::from(gear)).collect()),
            Column::numbers("x_mm", all().map(|(_, [x, _])| x).collect()),
            Column::numbers("y_mm", all().map(|(_, [_, y])| y).collect()),
        ],
    };
    let series = gears
        .iter()
        .map(|(gear, outline)| Series {
            name: format!("gear {}", gear.number()),
            ink: if *gear == Gear::Driver { Ink::Ccw } else { Ink::Cw },
            mark: Mark::Line,
            points: in_mesh(pair, *gear, outline, theta1_rad),
        })
        .collect();
    let panel = Panel {
        title: format!("In mesh at θ1 = {:.2}°", theta1_rad.to_degrees()),
        x: Axis::Fitted("x / mm".into()),
        y_label: "y / mm".into(),
        scale: Scale::Equal,
        series,
    };
    Ok(args.output.deliver(Report { text, json, table, chart: Chart { panels: vec![panel] } }, &extras)?)
}

fn radii_mm(outline: &Outline) -> (f64, f64) {
    let radii = outline.points_mm.iter().map(|[x, y]| x.hypot(*y));
    radii.fold((f64::INFINITY, 0.0), |(low, high), radius| (low.min(radius), high.max(radius)))
}

/// `gears.dxf` and 1: `gears-1.dxf`.
fn numbered(path: &Path, number: u8) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(extension) => format!("{stem}-{number}.{}", extension.to_string_lossy()),
        None => format!("{stem}-{number}"),
    };
    path.with_file_name(name)
}

/// The outline where it stands at θ1, closed: gear 1 turned by θ1 about the origin, gear 2 by −f(θ1) about (a, 0).
fn in_mesh(pair: &gearmodel::GearPair, gear: Gear, outline: &Outline, theta1_rad: f64) -> Vec<(f64, f64)> {
    let (turn_rad, centre_mm) = match gear {
        Gear::Driver => (theta1_rad, 0.0),
        Gear::Driven => (-pair.theta2(theta1_rad), pair.centre_distance_mm()),
    };
    let (sin, cos) = turn_rad.sin_cos();
    let place = |[x, y]: &[f64; 2]| (centre_mm + x * cos - y * sin, x * sin + y * cos);
    outline.points_mm.iter().chain(outline.points_mm.first()).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_before_the_extension() {
        assert_eq!(numbered(Path::new("out/gears.v2.dxf"), 1), Path::new("out/gears.v2-1.dxf"));
        assert_eq!(numbered(Path::new("gears"), 2), Path::new("gears-2"));
    }
}
