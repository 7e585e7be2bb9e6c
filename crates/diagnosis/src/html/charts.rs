//! Bars and curves: how large the gap is, what it is made of, where it lies, and each run before and after.

use super::svg::{Anchor, Svg, tick_label, tick_step};
use crate::diagnosis::{Curve, Diagnosis, Slice};
use crate::summary::quantity::{percent, urad};
use crate::summary::words;

const URAD: f64 = 1e6;
/// Most bars in one chart; more are joined by their RMS.
const MOST_BARS: usize = 48;
/// Most points of a curve: fifteen a tooth of the common gears, so that no mesh order is averaged away.
const MOST_POINTS: usize = 720;
/// Most runs drawn one by one.
pub const MOST_RUNS: usize = 24;

/// The gap before, after and at the floor, on one scale.
pub fn gap(diagnosis: &Diagnosis) -> String {
    let gap = &diagnosis.gap;
    let rows = [
        ("nominal model", "before", gap.before_rad),
        ("with the causes found", "after", gap.after_rad),
        ("what does not repeat", "floor", gap.floor_rad),
    ];
    let largest = rows.iter().map(|r| r.2).fold(f64::MIN_POSITIVE, f64::max);
    let (left, width) = (150.0, 430.0);
    let mut svg = Svg::new(700.0, 108.0);
    for (n, (name, class, value)) in rows.into_iter().enumerate() {
        let y = 6.0 + 34.0 * n as f64;
        let length = (width * value / largest).max(1.0);
        svg.text("t", [left - 8.0, y + 18.0], Anchor::End, name);
        svg.rect(class, [left, y], [length, 26.0], "");
        svg.text("t strong", [left + length + 8.0, y + 18.0], Anchor::Start, &format!("{} µrad", urad(value)));
    }
    // The floor's mark runs through all bars: nothing can come below it.
    let x = left + width * gap.floor_rad / largest;
    svg.line("mark", [x, 2.0], [x, 104.0]);
    svg.finish("gap before, after and floor")
}

/// Class of the n-th part of the budget.
pub fn part_class(n: usize, effect: &str) -> String {
    if effect == "unexplained" { "rest".to_owned() } else { format!("c{}", n % 8) }
}

/// Shares of the reducible gap as one stacked bar.
pub fn budget(diagnosis: &Diagnosis) -> String {
    let rows = &diagnosis.gap.budget;
    let total: f64 = rows.iter().map(|r| r.share.max(0.0)).sum::<f64>().max(f64::MIN_POSITIVE);
    let mut svg = Svg::new(700.0, 34.0);
    let mut x = 0.0;
    for (n, row) in rows.iter().enumerate() {
        let width = 700.0 * row.share.max(0.0) / total;
        let tip = format!("{}: {}", words::within(diagnosis, &row.effect), percent(row.share));
        svg.rect(&part_class(n, &row.effect), [x, 2.0], [width, 30.0], &tip);
        if width > 60.0 {
            svg.text("t on", [x + width / 2.0, 22.0], Anchor::Middle, &percent(row.share));
        }
        x += width;
    }
    svg.finish("shares of the reducible gap")
}

/// Neighbours joined until they fit; by RMS, as parts of a whole join.
fn joined(slices: &[Slice]) -> Vec<Slice> {
    let size = slices.len().div_ceil(MOST_BARS).max(1);
    let rms = |part: &[Slice], of: fn(&Slice) -> f64| {
        (part.iter().map(|s| of(s).powi(2)).sum::<f64>() / part.len() as f64).sqrt()
    };
    slices
        .chunks(size)
        .map(|part| Slice { at: part[0].at.clone(), rad: rms(part, |s| s.rad), floor_rad: rms(part, |s| s.floor_rad) })
        .collect()
}

fn name_of(slice: &Slice) -> String {
    match slice.at.as_f64() {
        Some(x) if x.fract().abs() < 1e-9 => format!("{x:.0}"),
        Some(x) => format!("{x:.1}"),
        None => slice.at.as_str().unwrap_or_default().to_owned(),
    }
}

/// One quantity's slices as bars, each with the floor beside it.
pub fn slices(title: &str, unit: &str, slices: &[Slice]) -> String {
    let bars = joined(slices);
    if bars.is_empty() {
        return String::new();
    }
    let largest = URAD * bars.iter().map(|s| s.rad.max(s.floor_rad)).fold(f64::MIN_POSITIVE, f64::max);
    let step = tick_step(largest, 3.0);
    let top = step * (largest / step).ceil();
    let ([x0, y0], [width, height]) = ([52.0, 26.0], [284.0, 96.0]);
    let mut svg = Svg::new(344.0, 158.0);
    svg.text("t strong", [0.0, 13.0], Anchor::Start, title);
    svg.text("t small", [344.0, 13.0], Anchor::End, "µrad");
    let y_of = |value: f64| y0 + height * (1.0 - value / top);
    let mut level = 0.0;
    while level <= top * 1.0001 {
        svg.line("grid", [x0, y_of(level)], [x0 + width, y_of(level)]);
        svg.text("t small", [x0 - 5.0, y_of(level) + 4.0], Anchor::End, &tick_label(level, step));
        level += step;
    }
    let pitch = width / bars.len() as f64;
    // A handful of bars need not be walls.
    let thick = (0.78 * pitch).min(42.0);
    // Labels need room for their longest text.
    let longest = bars.iter().map(|b| name_of(b).chars().count()).max().unwrap_or(1) as f64;
    let every = ((6.5 * longest + 8.0) / pitch).ceil().max(1.0) as usize;
    for (n, bar) in bars.iter().enumerate() {
        let middle = x0 + pitch * (n as f64 + 0.5);
        let tip = format!("{} {unit}: {} µrad, floor {} µrad", name_of(bar), urad(bar.rad), urad(bar.floor_rad));
        let y = y_of(URAD * bar.rad);
        let class = if bar.rad > 1.5 * bar.floor_rad { "before" } else { "quiet" };
        svg.rect(class, [middle - thick / 2.0, y], [thick, y0 + height - y], &tip);
        let floor = y_of(URAD * bar.floor_rad);
        svg.line("mark", [middle - pitch / 2.0, floor], [middle + pitch / 2.0, floor]);
        if n % every == 0 {
            svg.text("t small", [middle, y0 + height + 14.0], Anchor::Middle, &name_of(bar));
        }
    }
    svg.text("t small", [x0 + width / 2.0, y0 + height + 30.0], Anchor::Middle, unit);
    svg.finish(&format!("gap {title}"))
}

/// Ticks of a turn of the driver, with their labels under `y`.
pub fn turn_axis(svg: &mut Svg, [x0, y]: [f64; 2], width: f64) {
    for quarter in 0..=4 {
        let x = x0 + width * f64::from(quarter) / 4.0;
        svg.line("axis", [x, y], [x, y + 4.0]);
        // The last label ends at the frame, or it would be cut off.
        let anchor = if quarter == 4 { Anchor::End } else { Anchor::Middle };
        svg.text("t small", [x, y + 16.0], anchor, &format!("{}°", 90 * quarter));
    }
}

/// Label of a run.
pub fn run_label(curve: &Curve) -> String {
    use crate::summary::quantity::plain;
    // Means of what was measured: three digits tell runs apart.
    let round = |x: f64| if x.abs() < 1.0 { plain((x * 1e3).round() / 1e3) } else { plain((x * 10.0).round() / 10.0) };
    format!("{} {} N·m {} rpm", curve.direction, round(curve.load_nm), round(curve.speed_rpm))
}

/// The scale that all runs share: the largest value, or the 98th percentile where single steps would flatten the rest.
pub fn shared_scale_rad(curves: &[Curve]) -> f64 {
    let mut sizes: Vec<f64> = curves
        .iter()
        .flat_map(|c| c.before_rad.iter().chain(&c.after_rad))
        .map(|x| x.abs())
        .filter(|x| x.is_finite())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes.get((0.98 * sizes.len() as f64) as usize).copied().unwrap_or(0.0);
    match sizes.last() {
        Some(largest) if *largest > 0.0 => {
            if *largest > 2.5 * usual && usual > 0.0 {
                usual
            } else {
                *largest
            }
        }
        _ => 1e-6,
    }
}

/// Mean residual of one run over the turn, before and after.
pub fn run(curve: &Curve, scale_rad: f64) -> String {
    let ([x0, y0], [width, height]) = ([52.0, 24.0], [284.0, 110.0]);
    let mut svg = Svg::new(344.0, 158.0);
    svg.text("t strong", [0.0, 13.0], Anchor::Start, &run_label(curve));
    svg.text("t small", [344.0, 13.0], Anchor::End, "µrad");
    let half = 1.08 * URAD * scale_rad;
    let y_of = |value_rad: f64| y0 + height / 2.0 * (1.0 - (URAD * value_rad / half).clamp(-1.0, 1.0));
    let step = tick_step(2.0 * half, 4.0);
    let most = (half / step).floor() as i32;
    for n in -most..=most {
        let value = f64::from(n) * step;
        let y = y_of(value / URAD);
        svg.line(if n == 0 { "axis" } else { "grid" }, [x0, y], [x0 + width, y]);
        svg.text("t small", [x0 - 5.0, y + 4.0], Anchor::End, &tick_label(value, step));
    }
    let thin = curve.theta1_rad.len().div_ceil(MOST_POINTS).max(1);
    for (class, values) in [("line-before", &curve.before_rad), ("line-after", &curve.after_rad)] {
        let angles = curve.theta1_rad.chunks(thin);
        // The mean of neighbours, not every n-th: nothing is hidden between.
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let mut last = f64::NAN;
        let points = angles.zip(values.chunks(thin)).flat_map(|(a, v)| {
            let angle = mean(a);
            // Where bins are missing the line stops.
            let gap = angle - last > 0.35;
            last = angle;
            let point = [x0 + width * angle / std::f64::consts::TAU, y_of(mean(v))];
            if gap { vec![[f64::NAN; 2], point] } else { vec![point] }
        });
        svg.curve(class, points);
    }
    turn_axis(&mut svg, [x0, y0 + height], width);
    svg.finish(&format!("residual before and after, {}", run_label(curve)))
}
