//! The residual as a picture: over the driver's angle by revolution, and by load.

use std::fmt::Write as _;

use super::charts::{MOST_RUNS, run_label, turn_axis};
use super::svg::{Anchor, Svg};
use crate::diagnosis::Curve;
use crate::summary::quantity::{plain, urad};
use gearmodel::Direction;

/// Cells over a turn: five a tooth of the common gears, so that teeth do not beat with cells.
const CELLS: usize = 240;
/// Most rows of one run; more revolutions are averaged.
const MOST_ROWS: usize = 8;
/// Steps of colour on either side of zero.
const LEVELS: i32 = 6;
const LEFT: f64 = 150.0;
const WIDTH: f64 = 540.0;

/// A row of the map: means of the bins that fall into each cell; NaN where nothing was measured.
fn row(source: &[&[f64]]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); CELLS];
    for values in source {
        for (n, value) in values.iter().enumerate().filter(|(_, v)| v.is_finite()) {
            let from = n * CELLS / values.len();
            // Fewer bins than cells: a bin fills all that it covers.
            let to = ((n + 1) * CELLS / values.len()).max(from + 1).min(CELLS);
            for sum in &mut sums[from..to] {
                sum.0 += value;
                sum.1 += 1.0;
            }
        }
    }
    sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { f64::NAN }).collect()
}

/// Rows of one run, revolutions joined where there are many.
fn rows(curve: &Curve) -> Vec<Vec<f64>> {
    let size = curve.map_rad.len().div_ceil(MOST_ROWS).max(1);
    curve.map_rad.chunks(size).map(|part| row(&part.iter().map(Vec::as_slice).collect::<Vec<_>>())).collect()
}

/// The value that takes the deepest colour: the 98th percentile.
fn deepest_rad<'a>(rows: impl Iterator<Item = &'a Vec<f64>>) -> f64 {
    let mut sizes: Vec<f64> = rows.flatten().map(|x| x.abs()).filter(|x| x.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let at = (0.98 * sizes.len() as f64) as usize;
    sizes.get(at.min(sizes.len().saturating_sub(1))).copied().filter(|s| *s > 0.0).unwrap_or(1e-6)
}

/// Step of colour of a value; `None` where nothing was measured.
fn level(value_rad: f64, deepest_rad: f64) -> Option<i32> {
    value_rad.is_finite().then(|| (value_rad / deepest_rad * f64::from(LEVELS)).round().clamp(-6.0, 6.0) as i32)
}

fn level_class(level: Option<i32>) -> String {
    match level {
        None => "none".to_owned(),
        Some(n) if n < 0 => format!("m{}", -n),
        Some(n) => format!("p{n}"),
    }
}

/// Draws rows from `y` downwards: equal neighbours are one stroke, and all strokes of a colour one path.
fn paint(svg: &mut Svg, rows: &[(f64, Vec<f64>)], row_height: f64, deepest_rad: f64) {
    let mut paths: std::collections::BTreeMap<Option<i32>, String> = std::collections::BTreeMap::new();
    let cell = WIDTH / CELLS as f64;
    for (y, values) in rows {
        let levels: Vec<_> = values.iter().map(|v| level(*v, deepest_rad)).collect();
        let mut from = 0;
        for run in levels.chunk_by(|a, b| a == b) {
            // Zero is the paper's own colour.
            if run[0] != Some(0) {
                let path = paths.entry(run[0]).or_default();
                // Writing to a String cannot fail.
                let x = LEFT + cell * from as f64;
                let _ = write!(path, "M{x:.1} {:.1}h{:.1}", y + row_height / 2.0, cell * run.len() as f64);
            }
            from += run.len();
        }
    }
    for (level, path) in paths {
        svg.stroke(&level_class(level), row_height, &path);
    }
}

fn legend(svg: &mut Svg, y: f64, deepest_rad: f64) {
    let step = 22.0;
    let width = step * f64::from(2 * LEVELS + 1);
    let x0 = LEFT + (WIDTH - width) / 2.0;
    for n in -LEVELS..=LEVELS {
        let x = x0 + step * f64::from(n + LEVELS);
        svg.stroke(&level_class(Some(n)), 10.0, &format!("M{x:.1} {y:.1}h{step:.1}"));
    }
    svg.rect("frame", [x0, y - 5.0], [width, 10.0], "");
    let text = urad(deepest_rad);
    svg.text("t small", [x0 - 6.0, y + 4.0], Anchor::End, &format!("driven gear behind  −{text} µrad"));
    svg.text("t small", [x0 + width + 6.0, y + 4.0], Anchor::Start, &format!("+{text} µrad  ahead"));
}

/// Angle by revolution, run under run in their order of time.
pub fn by_revolution(curves: &[Curve]) -> String {
    let shown: Vec<(&Curve, Vec<Vec<f64>>)> = curves.iter().take(MOST_RUNS).map(|c| (c, rows(c))).collect();
    if shown.iter().all(|(_, rows)| rows.is_empty()) {
        return String::new();
    }
    let deepest = deepest_rad(shown.iter().flat_map(|(_, rows)| rows));
    let row_height = 6.0;
    let block = |rows: &Vec<Vec<f64>>| (row_height * rows.len() as f64).max(16.0) + 3.0;
    let height: f64 = shown.iter().map(|(_, rows)| block(rows)).sum();
    let mut svg = Svg::new(700.0, height + 64.0);
    let mut y = 4.0;
    for (curve, rows) in &shown {
        let tall = (block(rows) - 3.0) / rows.len().max(1) as f64;
        let placed: Vec<_> = rows.iter().enumerate().map(|(n, row)| (y + tall * n as f64, row.clone())).collect();
        paint(&mut svg, &placed, tall, deepest);
        svg.rect("frame", [LEFT, y], [WIDTH, block(rows) - 3.0], "");
        svg.text("t small", [LEFT - 6.0, y + (block(rows) - 3.0) / 2.0 + 4.0], Anchor::End, &run_label(curve));
        y += block(rows);
    }
    turn_axis(&mut svg, [LEFT, y], WIDTH);
    svg.text(
        "t small",
        [LEFT + WIDTH / 2.0, y + 30.0],
        Anchor::Middle,
        "driver angle; within a run, revolutions downwards",
    );
    legend(&mut svg, y + 46.0, deepest);
    svg.finish("residual over driver angle and revolution")
}

/// Angle by load and sense; empty where one load was measured.
pub fn by_load(curves: &[Curve]) -> String {
    let mut loads: Vec<f64> = curves.iter().map(|c| c.load_nm).collect();
    loads.sort_by(f64::total_cmp);
    // Loads within a hundredth of the largest are one.
    let near = 0.01 * loads.last().copied().unwrap_or(0.0).abs() + 1e-9;
    loads.dedup_by(|a, b| (*a - *b).abs() <= near);
    if loads.len() < 2 {
        return String::new();
    }
    let mut rows = Vec::new();
    for direction in [Direction::Ccw, Direction::Cw] {
        for load in &loads {
            let source: Vec<&[f64]> = curves
                .iter()
                .filter(|c| c.direction == direction && (c.load_nm - load).abs() <= near)
                .flat_map(|c| c.map_rad.iter().map(Vec::as_slice))
                .collect();
            if !source.is_empty() {
                rows.push((direction, *load, row(&source)));
            }
        }
    }
    let deepest = deepest_rad(rows.iter().map(|(_, _, row)| row));
    let tall = 18.0;
    let mut svg = Svg::new(700.0, tall * rows.len() as f64 + 76.0);
    let mut y = 4.0;
    let mut placed = Vec::new();
    let mut last = None;
    for (direction, load, row) in rows {
        if last.is_some_and(|d| d != direction) {
            y += 8.0;
        }
        last = Some(direction);
        let load = plain((load * 1e3).round() / 1e3);
        svg.text("t small", [LEFT - 6.0, y + 13.0], Anchor::End, &format!("{direction} {load} N·m"));
        placed.push((y, row));
        y += tall;
    }
    paint(&mut svg, &placed, tall, deepest);
    for (y, _) in &placed {
        svg.rect("frame", [LEFT, *y], [WIDTH, tall], "");
    }
    turn_axis(&mut svg, [LEFT, y], WIDTH);
    svg.text(
        "t small",
        [LEFT + WIDTH / 2.0, y + 30.0],
        Anchor::Middle,
        "driver angle; all speeds and revolutions of a load averaged",
    );
    legend(&mut svg, y + 46.0, deepest);
    svg.finish("residual over driver angle and load")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_that_were_not_measured_stay_empty() {
        let values = [f64::NAN, 1.0, 1.0, f64::NAN];
        let row = row(&[&values]);
        assert!(row[0].is_nan() && row[CELLS - 1].is_nan());
        assert_eq!(row[CELLS / 2], 1.0);
    }

    #[test]
    fn colours_are_symmetric_and_clip() {
        assert_eq!(level(2.0, 1.0), Some(6));
        assert_eq!(level(-0.5, 1.0), Some(-3));
        assert_eq!(level(f64::NAN, 1.0), None);
        assert_eq!(level_class(Some(-3)), "m3");
    }
}
