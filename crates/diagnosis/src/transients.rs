//! Knocks against the rig, lost readings, bursts: short segments that stand far out of the other revolutions at the same angle and
//! leave no step behind. No trace of angle, load or speed describes them, and as scatter they would drown everything else: they
//! are cut out and reported.

use super::grid::Grid;
use super::reduce::ReducedRun;
use super::settings::TransientSettings;

/// Median absolute deviation → standard deviation.
const OF_MEDIAN: f64 = 1.4826;

/// Knocks that were cut out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Transients {
    /// How many.
    pub count: usize,
    /// Time of the first since the campaign's start, s.
    pub first_s: f64,
    /// Largest deviation of a bin, rad.
    pub peak_rad: f64,
    /// Their mean square over the campaign's samples, rad².
    pub mean_square_rad2: f64,
    /// Frequency at which they ring, Hz.
    pub ring_hz: f64,
}

/// Finds knocks and cuts their points out of the runs; `None` where there are none.
pub fn take_off(grid: &Grid, runs: &mut [ReducedRun], settings: &TransientSettings) -> Option<Transients> {
    let mut cut = vec![false; grid.places.len()];
    let mut found: Vec<Window> = Vec::new();
    // Where they crowd, they stand in the medians that they are found by: once more without those that are known.
    for _ in 0..settings.passes {
        let more = find(grid, &cut, settings)?;
        for window in &more {
            cut[window.places.clone()].fill(true);
        }
        let none = more.is_empty();
        found.extend(more);
        if none || share(&cut) > settings.most {
            break;
        }
    }
    if found.is_empty() || share(&cut) > settings.most {
        return None;
    }
    let mut transients = Transients { count: found.len(), first_s: f64::INFINITY, ..Transients::default() };
    let sum = |of: fn(&Window) -> f64| found.iter().map(of).sum::<f64>();
    transients.ring_hz = 0.5 * sum(|w| w.crossings) / sum(|w| w.lasts_s).max(f64::MIN_POSITIVE);
    for window in &found {
        transients.first_s = transients.first_s.min(window.begin_s);
        transients.peak_rad = transients.peak_rad.max(window.peak_rad);
        transients.mean_square_rad2 += window.square_rad2 / grid.samples;
        // They ring on under the scatter.
        let run = grid.places[window.places.start].run;
        let tail = window.places.end..window.places.end + window.places.len() / 2;
        for place in tail.take_while(|p| grid.places.get(*p).is_some_and(|at| at.run == run)) {
            cut[place] = true;
        }
    }
    for (run, places) in runs.iter_mut().zip(&grid.place_of_point) {
        let mut place = places.iter();
        run.points.retain(|_| place.next().is_none_or(|p| !cut[*p]));
    }
    Some(transients)
}

fn share(cut: &[bool]) -> f64 {
    cut.iter().filter(|cut| **cut).count() as f64 / cut.len() as f64
}

/// A segment that stands out.
struct Window {
    places: std::ops::Range<usize>,
    begin_s: f64,
    peak_rad: f64,
    /// Weighted sum of squares.
    square_rad2: f64,
    /// How long it lasts, s, and how often it changes sign.
    lasts_s: f64,
    crossings: f64,
}

/// Knocks outside what is cut already; `None` where cells do not come again often enough.
fn find(grid: &Grid, cut: &[bool], settings: &TransientSettings) -> Option<Vec<Window>> {
    let Deviations { plain, beyond_climb: deviations } = deviations(grid, cut)?;
    // As a bin of mean weight would scatter.
    let mean_weight = grid.samples / grid.places.len() as f64;
    let even = |of: &[f64]| -> Vec<f64> {
        of.iter().zip(&grid.weight).map(|(d, w)| d * (w / mean_weight).min(1.0).sqrt()).collect()
    };
    let plain = even(&plain);
    let even = even(&deviations);
    let mut found = Vec::new();
    for run in 0..grid.directions.len() {
        let mut places = grid.revolutions.iter().filter(|r| r.run == run).map(|r| r.places.clone());
        let Some(first) = places.next() else { continue };
        let of_run = first.start..places.next_back().map_or(first.end, |last| last.end);
        // A rig that shakes more under one condition than another is not knocked there.
        let Some(Scatter { sigma_rad, outstanding_rad }) =
            scatter(&plain[of_run.clone()], &cut[of_run.clone()], settings)
        else {
            continue;
        };
        let mut at = of_run.start;
        while let Some(begin) = (at..of_run.end).find(|p| even[*p].abs() > outstanding_rad) {
            let window = window(&even, &of_run, begin, settings.quiet * sigma_rad, settings.quiet_places);
            at = window.end;
            let peak_rad = window.clone().map(|p| deviations[p].abs()).fold(0.0, f64::max);
            // What is under way where the run begins and comes to rest from one side settles; what lasts to its end may be a step.
            let at_an_end =
                window.start < of_run.start + settings.quiet_places || window.end + settings.quiet_places > of_run.end;
            let settles = at_an_end
                && window.len() > settings.settling_places
                && one_sided(&deviations[window.clone()], settings);
            if settles || leaves_a_step(&deviations, &of_run, &window, peak_rad, settings) {
                continue;
            }
            found.push(Window {
                begin_s: grid.places[begin].time_s,
                peak_rad,
                lasts_s: grid.places[window.end - 1].time_s - grid.places[window.start].time_s,
                crossings: deviations[window.clone()].windows(2).filter(|d| d[0] * d[1] < 0.0).count() as f64,
                square_rad2: window.clone().map(|p| grid.weight[p] * deviations[p] * deviations[p]).sum(),
                places: window,
            });
        }
    }
    Some(found)
}

/// Residual of every place less the median of its cell over the revolutions.
struct Deviations {
    plain: Vec<f64>,
    /// Less what the residual climbs from there to the next cells: where a tooth takes over, samples a little further on read that
    /// much more.
    beyond_climb: Vec<f64>,
}

/// `None` where cells do not come again often enough; what is cut deviates by nothing.
fn deviations(grid: &Grid, cut: &[bool]) -> Option<Deviations> {
    let mut cells: Vec<Vec<f64>> = vec![Vec::new(); grid.cells.len()];
    for (place, cell) in grid.cell_of.iter().enumerate() {
        if !cut[place] {
            cells[*cell].push(grid.rho_rad[place]);
        }
    }
    if grid.places.len() < 3 * grid.cells.len() {
        return None;
    }
    let medians: Vec<f64> = cells
        .into_iter()
        .map(|mut values| {
            if values.is_empty() {
                return 0.0;
            }
            values.sort_by(f64::total_cmp);
            0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2])
        })
        .collect();
    let climb = |cell: usize| {
        let next = |other: usize| medians.get(other).map_or(0.0, |m| (m - medians[cell]).abs());
        next(cell + 1).max(next(cell.wrapping_sub(1)))
    };
    let plain: Vec<f64> = (grid.cell_of.iter().zip(&grid.rho_rad).zip(cut))
        .map(|((cell, rho), cut)| if *cut { 0.0 } else { rho - medians[*cell] })
        .collect();
    let beyond_climb =
        grid.cell_of.iter().zip(&plain).map(|(cell, d)| (d.abs() - climb(*cell)).max(0.0).copysign(*d)).collect();
    Some(Deviations { plain, beyond_climb })
}

/// How a run scatters.
struct Scatter {
    /// Standard deviation by the median.
    sigma_rad: f64,
    /// What stands out of it.
    outstanding_rad: f64,
}

/// Of what is not cut; `None` where nothing is left.
fn scatter(deviations: &[f64], cut: &[bool], settings: &TransientSettings) -> Option<Scatter> {
    let mut sizes: Vec<f64> = deviations.iter().zip(cut).filter(|(_, cut)| !**cut).map(|(d, _)| d.abs()).collect();
    let (count, middle) = (sizes.len() as f64, sizes.len() / 2);
    let median_rad = (!sizes.is_empty()).then(|| *sizes.select_nth_unstable_by(middle, f64::total_cmp).1)?;
    let sigma_rad = (OF_MEDIAN * median_rad).max(settings.least_rad);
    // Between knocks it is quiet; a rig that rings all the time has high peaks too.
    let rms_rad = (sizes.iter().map(|d| d * d).sum::<f64>() / count).sqrt();
    let rings = if sigma_rad > settings.ringing * rms_rad { settings.ringing_peaks } else { 1.0 };
    Some(Scatter { sigma_rad, outstanding_rad: settings.outstanding * rings * sigma_rad })
}

/// From where it begins to be loud to where it has been quiet for a while.
fn window(
    deviations: &[f64],
    run: &std::ops::Range<usize>,
    begin: usize,
    quiet_rad: f64,
    quiet_places: usize,
) -> std::ops::Range<usize> {
    let loud = |p: &usize| deviations[*p].abs() > quiet_rad;
    let mut start = begin;
    while let Some(before) = (start.saturating_sub(quiet_places).max(run.start)..start).find(loud) {
        start = before;
    }
    let mut end = begin + 1;
    while let Some(after) = (end..(end + quiet_places).min(run.end)).rfind(loud) {
        end = after + 1;
    }
    start..end
}

/// Whether nearly all of it lies on one side.
fn one_sided(deviations: &[f64], settings: &TransientSettings) -> bool {
    let (sum, total) = deviations.iter().fold((0.0, 0.0), |(sum, total), d| (sum + d, total + d.abs()));
    f64::abs(sum) > settings.one_sided * total
}

/// Whether the level before and after differs by a good part of the peak.
fn leaves_a_step(
    deviations: &[f64],
    run: &std::ops::Range<usize>,
    window: &std::ops::Range<usize>,
    peak_rad: f64,
    settings: &TransientSettings,
) -> bool {
    let median = |range: std::ops::Range<usize>| {
        let mut values = deviations[range].to_vec();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    let before = median(window.start.saturating_sub(settings.beside).max(run.start)..window.start);
    let after = median(window.end..(window.end + settings.beside).min(run.end));
    (after - before).abs() > settings.step * peak_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use gearmodel::effect::{NominalRig, OperatingPoint};

    /// One run of four turns with the residual as given at (turn, bin).
    fn grid(rho: impl Fn(usize, usize) -> f64) -> Grid {
        let bins = 100;
        let rig = NominalRig::new(pair(), gearmodel::Errors::default(), [None, None], None);
        let mut grid = Grid::new(&rig, &[], &crate::Settings::default());
        grid.bins = bins;
        grid.cells = vec![OperatingPoint::default(); bins];
        grid.directions = vec![gearmodel::Direction::Ccw];
        for turn in 0..4 {
            for bin in 0..bins {
                grid.places.push(OperatingPoint { time_s: (turn * bins + bin) as f64, ..OperatingPoint::default() });
                grid.cell_of.push(bin);
                // Scatter of 1 µrad that repeats nowhere.
                let scatter = 1e-6 * (((turn * bins + bin) * 7919 % 101) as f64 / 50.0 - 1.0);
                grid.rho_rad.push(rho(turn, bin) + scatter);
                grid.weight.push(2.0);
            }
            let places = turn * bins..(turn + 1) * bins;
            grid.revolutions.push(super::super::grid::Revolution { run: 0, places, coverage: 1.0 });
        }
        grid.samples = 800.0;
        grid.place_of_point = vec![(0..400).collect()];
        grid
    }

    fn pair() -> gearmodel::GearPair {
        gearmodel::GearPair::constant(1.0).unwrap()
    }

    fn run() -> ReducedRun {
        let points = vec![super::super::reduce::Point::default(); 400];
        ReducedRun { direction: gearmodel::Direction::Ccw, speed_rpm: 5.0, points, within_rad2: 0.0, samples: 800.0 }
    }

    #[test]
    fn a_burst_is_cut_out_and_a_step_or_a_trace_of_the_angle_is_not() {
        let settings = TransientSettings::default();
        let ringing = |turn: usize, bin: usize| {
            let after = bin as f64 - 40.0;
            if turn == 2 && after >= 0.0 { 80e-6 * (-after / 5.0).exp() * after.cos() } else { 0.0 }
        };
        let mut runs = [run()];
        let found = take_off(&grid(ringing), &mut runs, &settings).expect("a knock");
        assert_eq!((found.count, found.first_s), (1, 240.0));
        assert!((found.peak_rad - 80e-6).abs() < 3e-6, "{found:?}");
        let lost = 400 - runs[0].points.len();
        assert!((10..40).contains(&lost), "{lost} points lost");

        let quiet: [&dyn Fn(usize, usize) -> f64; 3] = [
            &|_, _| 0.0,
            // The same in every turn, however large.
            &|_, bin| if bin == 17 { 1e-3 } else { 0.0 },
            // A count lost within the third turn.
            &|turn, bin| if (turn, bin) >= (2, 60) { 40e-6 } else { 0.0 },
        ];
        for (n, rho) in quiet.into_iter().enumerate() {
            let mut runs = [run()];
            assert!(take_off(&grid(rho), &mut runs, &settings).is_none(), "case {n}");
            assert_eq!(runs[0].points.len(), 400, "case {n}");
        }
    }
}
