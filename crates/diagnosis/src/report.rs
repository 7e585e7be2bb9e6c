//! From the models seen to the fields of the diagnosis.

use serde_json::{Map, Value as Json, json};

use super::*;
use crate::cross_validation::{HeldOut, Selection};
use crate::line_phase::LineError;
use gearmodel::effect::{Carrier, Parameter, Parity, Signature, Value};

/// Under 1 it flattens what the noise model's own error makes too sure; calibrated on simulated campaigns.
const SHARPNESS: f64 = 1.0;
/// Standard deviations are this much larger than under the noise model alone, whose own error they do not know; calibrated on
/// simulated campaigns.
const WIDER: f64 = 1.25;
/// How exact parameters are at best, in parts of their value, and phases in rad.
const LINEARISED: f64 = 0.006;
/// Members of a group nearer than this have one and the same trace, deg.
const IDENTICAL_DEG: f64 = 0.2;
/// A sum of two effects nearer than this to a third looks like it, deg.
const MIMIC_DEG: f64 = 4.0;
/// Most warnings of such sums.
const MOST_MIMICS: usize = 5;
/// Probability of a tone that was found over all frequencies, and of knocks far out of the scatter.
const EVENT_PROBABILITY: f64 = 0.99;
/// Prior odds of a sub-divisional error.
const LINE_ODDS: f64 = 0.04;
/// An effect or a remainder under this part of what was found may be the found effects' own inexactness; under this part of the
/// floor, the nominal and the noise model's.
const INEXACT: f64 = 0.05;
const INEXACT_OF_FLOOR: f64 = 0.08;
/// The same of a resonance: how it is excited is known less well than geometry is.
const INEXACT_RINGING: f64 = 0.08;
/// Knocks ring at a resonance's own frequency where both are no further apart than a factor of e to this.
const SAME_RING: f64 = 0.3;
/// A wandering level under this part of the floor may be scatter; so may one that steps between runs.
const WANDERS_OF_FLOOR: f64 = 0.8;
const STEPS_OF_FLOOR: f64 = 0.4;

/// Largest probability of what may be no more than that.
const INEXACT_PROBABILITY: f64 = 0.02;

/// Largest probability of steps that make the prediction of held-out runs worse.
const UNPREDICTIVE_PROBABILITY: f64 = 0.3;

/// Smallest RMS worth naming beside what was found and what does not repeat.
fn least_rad(found_rad2: f64, rings_rad2: f64, floor_rad: f64) -> f64 {
    let part = (INEXACT * found_rad2.sqrt()).max(INEXACT_RINGING * rings_rad2.sqrt());
    part.max(INEXACT_OF_FLOOR * floor_rad)
}

/// What is named, and groups whose members have one and the same trace with the probability that one of them is there.
struct Named {
    groups: Vec<Group>,
    verdict: Vec<Verdict>,
    identical: Vec<(Vec<usize>, f64)>,
}

/// What is known of one effect.
struct Finding {
    number: usize,
    probability: f64,
    block: Option<usize>,
    estimate: Option<Estimate>,
    shape: gearmodel::effect::Shape,
    rms_rad: f64,
    shrink: Option<f64>,
    confusable: Vec<(usize, f64)>,
    /// Most that its probability may be, whatever the evidence.
    most: f64,
}

impl Engine<'_> {
    pub(super) fn report(&self, lines: &[LineError]) -> Option<Diagnosis> {
        let posterior = posterior::posterior(&self.design, &self.models, SHARPNESS);
        let best = self.models.first()?;
        let mut search = self.search_in(&self.design, &self.whitened);
        let mut findings = self.findings(&posterior, best, &mut search, lines);

        // Held-out shrink: of the best model, and of each effect alone.
        let mut columns: Vec<usize> = best.fit.columns.clone();
        columns.extend(findings.iter().filter_map(|f| f.block).flat_map(|b| self.design.blocks[b].columns.clone()));
        columns.sort_unstable();
        columns.dedup();
        let held_out = HeldOut::new(&self.grid, &self.design, &self.noise, &columns);
        let floor_rad2 = held_out.floor_rad2(&self.grid, &self.noise);
        let before = held_out.errors(&Selection::default());
        let after = held_out.errors(&self.selection(best, None));
        let found = !best.fit.set.is_empty() || !lines.is_empty() || !self.aside.is_empty();
        let lines_rad2 = lines.iter().map(|l| l.explained_rad2).sum::<f64>() / self.grid.samples;
        let explained_rad2 = lines_rad2 + self.aside.mean_square_rad2();
        // What the place's own samples scatter, less what the lines explain of it.
        let within_rad2 = self.grid.within_rad2 / self.grid.samples;
        let mut gap = cross_validation::gap(&before, &after, floor_rad2, within_rad2, explained_rad2, found);
        let reducible = before.mean() + explained_rad2 - floor_rad2;
        for finding in &mut findings {
            finding.shrink = match finding.block {
                Some(block) if reducible > 0.0 => {
                    let d = self.design.blocks[block].width() as f64;
                    let scale = finding.rms_rad.max(1e-6);
                    let alone = held_out.errors(&Selection {
                        columns: self.design.blocks[block].columns.clone().collect(),
                        prior_rad2: vec![scale * scale / d; d as usize],
                    });
                    Some((before.mean() - alone.mean()) / reducible)
                }
                None if finding.probability > NAMED && reducible > 0.0 => Some(explained_rad2 / reducible),
                _ => None,
            };
        }
        let total_rad2 = findings
            .iter()
            .filter(|f| f.probability > NAMED && f.block.is_some_and(|b| best.fit.set.contains(&b)))
            .map(|f| f.rms_rad * f.rms_rad)
            .sum::<f64>();
        // What is too small to matter beside what was found, or beside what does not repeat.
        let unknown_rad2: f64 = (0..best.fit.set.len())
            .filter(|n| matches!(self.design.blocks[best.fit.set[*n]].candidate, Candidate::Unknown(_)))
            .map(|n| best.fit.rms_rad(&self.design, n).powi(2))
            .sum();
        let least_rad = least_rad(total_rad2 + unknown_rad2 + explained_rad2, self.rings_rad2(best), gap.floor_rad);
        let left: Vec<(&[&str], f64)> = findings
            .iter()
            .filter(|f| f.probability > NAMED)
            .map(|f| (LIBRARY[f.number].leaves(), f.rms_rad))
            .map(|((names, part), rms_rad)| (names, part * rms_rad))
            .collect();
        for finding in &mut findings {
            let name = LIBRARY[finding.number].name();
            let left_rad = left.iter().filter(|(names, _)| names.contains(&name)).map(|(_, rad)| *rad);
            let least_rad = left_rad.fold(least_rad, f64::max);
            if finding.rms_rad < least_rad {
                finding.most = INEXACT_PROBABILITY;
            } else if LIBRARY[finding.number].steps() {
                // Steps stand where this data wants them: that says little unless they hold for the runs that are left out.
                let own = |b: &usize| finding.block == Some(*b);
                let left_out = best.fit.set.iter().position(own);
                let without = left_out.map(|n| held_out.errors(&self.selection(best, Some(n))).mean());
                if without.is_some_and(|without| without <= after.mean()) {
                    finding.most = UNPREDICTIVE_PROBABILITY;
                }
            }
            finding.probability = finding.probability.min(finding.most);
        }
        findings.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(a.number.cmp(&b.number)));

        let Named { groups, verdict, identical } = self.verdict(&findings, &posterior, best);
        // Which of the same traces the search met first says nothing: they are equally probable.
        for (members, probability) in identical {
            for finding in findings.iter_mut().filter(|f| members.contains(&f.number)) {
                finding.probability = probability / members.len() as f64;
            }
        }
        findings.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(a.number.cmp(&b.number)));
        let unknown = self.unknown(&posterior, best, gap.floor_rad, lines_rad2);
        let mut verdict = verdict;
        if unknown.probability > NAMED {
            verdict.push(Verdict::Name("unknown".to_owned()));
        }
        gap.budget = self.budget(best, lines, reducible);
        let found = self.found(&findings, &verdict);
        let location = localisation::locate(&localisation::Inputs {
            rig: self.rig,
            grid: &self.grid,
            design: &self.design,
            noise: &self.noise,
            best: &best.fit,
            lines,
        });
        let confusability = self.confusability(&findings, best);
        let mut warnings = localisation::warnings(&self.grid, &self.noise);
        warnings.extend(self.mimics(&findings, &verdict));
        let next =
            experiment_design::experiments(&self.grid, &findings_for_next(&findings, &groups), &unknown, &warnings);
        let curves = localisation::curves(&self.grid, &self.design, &best.fit);
        Some(Diagnosis {
            gap,
            location,
            effects: findings.iter().map(|f| self.finding(f)).collect(),
            groups,
            unknown,
            verdict,
            next,
            warnings,
            confusability,
            found,
            curves,
        })
    }

    /// A model's columns, without one of its blocks.
    fn selection(&self, model: &Model, left_out: Option<usize>) -> Selection {
        let mut selection = Selection::default();
        for (n, (block, scale)) in model.fit.set.iter().zip(&model.fit.scales_rad).enumerate() {
            if Some(n) != left_out {
                let columns = self.design.blocks[*block].columns.clone();
                selection.prior_rad2.extend(columns.clone().map(|_| scale * scale / columns.len() as f64));
                selection.columns.extend(columns);
            }
        }
        selection
    }

    /// Every effect with its best block, its amplitudes as if it were the one, and who cannot be told from it.
    fn findings(
        &self,
        posterior: &Posterior,
        best: &Model,
        search: &mut Search<'_>,
        lines: &[LineError],
    ) -> Vec<Finding> {
        let mut findings = Vec::new();
        let empty = search.model(Vec::new(), None);
        for (number, effect) in LIBRARY.iter().enumerate() {
            let own: Vec<usize> = (0..self.design.blocks.len())
                .filter(|b| matches!(&self.design.blocks[*b].candidate, Candidate::Effect { number: n, .. } if *n == number))
                .collect();
            if let Some(encoder) = INTERPOLATION.iter().position(|n| *n == effect.name()) {
                findings.push(self.line_finding(number, encoder, lines));
                continue;
            }
            let block = posterior.block[number].or_else(|| {
                // Never part of a good model: the shape that fits best alone.
                let empty = empty.as_ref()?;
                let gains = evidence::scan(&self.design, &self.whitened, &empty.fit, &own);
                own.iter().zip(gains).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(b, _)| *b)
            });
            let Some(block) = block else { continue };
            // The block of the best model that this one would stand in for: itself, or one with the same trace.
            let stands_for = best.fit.set.iter().copied().find(|b| *b == block).or_else(|| {
                best.fit
                    .set
                    .iter()
                    .copied()
                    .find(|b| posterior::angle_deg(&self.design, &self.whitened, *b, block) < posterior::SAME_DEG)
            });
            let in_best = stands_for == Some(block);
            let mut model_with = |out: Option<usize>, b: usize| {
                let mut set: Vec<usize> = best.fit.set.iter().copied().filter(|x| Some(*x) != out).collect();
                set.push(b);
                search.model(set, Some(&best.fit))
            };
            let reference = if in_best {
                Some(best.score)
            } else {
                stands_for.and_then(|b| model_with(Some(b), block)).map(|m| m.score)
            };
            let confusable = match reference.filter(|_| posterior.probability[number] > 0.02) {
                Some(reference) => confusable(
                    &self.design,
                    &self.whitened,
                    posterior,
                    number,
                    &mut |b| model_with(stands_for, b).map(|m| m.score),
                    reference.max(best.score - 3.0),
                ),
                None => Vec::new(),
            };
            // Amplitudes: in the best model, in place of one with its trace or of another shape there, or beside it.
            let other_shape = best.fit.set.iter().copied().find(|b| own.contains(b));
            let model = if in_best { Some(best.clone()) } else { model_with(other_shape.or(stands_for), block) };
            let estimate = model.as_ref().and_then(|m| {
                let n = m.fit.set.iter().position(|b| *b == block)?;
                Some((self.raw(m, n), m.fit.rms_rad(&self.design, n)))
            });
            let shape = match &self.design.blocks[block].candidate {
                Candidate::Effect { shape, .. } => shape.clone(),
                Candidate::Unknown(_) => Vec::new(),
            };
            let rms_rad = estimate.as_ref().map_or(0.0, |(_, rms)| *rms);
            findings.push(Finding {
                number,
                probability: posterior.probability[number].min(1.0),
                block: Some(block),
                estimate: estimate.map(|(e, _)| e),
                shape,
                rms_rad,
                shrink: None,
                confusable,
                most: 1.0,
            });
        }
        findings
    }

    fn line_finding(&self, number: usize, encoder: usize, lines: &[LineError]) -> Finding {
        let strongest = lines
            .iter()
            .filter(|l| l.encoder == encoder)
            .max_by(|a, b| a.log_bayes_factor.total_cmp(&b.log_bayes_factor));
        let odds = strongest.map_or(f64::NEG_INFINITY, |l| l.log_bayes_factor + LINE_ODDS.ln());
        let rms_rad = lines
            .iter()
            .filter(|l| l.encoder == encoder)
            .map(|l| l.explained_rad2 / self.grid.samples)
            .sum::<f64>()
            .max(0.0)
            .sqrt();
        Finding {
            number,
            probability: 1.0 / (1.0 + (-odds).exp()),
            block: None,
            estimate: strongest.map(|l| Estimate {
                beta: l.amplitudes.to_vec(),
                covariance: nalgebra::DMatrix::from_column_slice(2, 2, l.covariance.as_slice()),
            }),
            shape: strongest.and_then(|l| Some(vec![l.order as f64, self.rig.lines[encoder]?])).unwrap_or_default(),
            rms_rad,
            shrink: None,
            confusable: Vec::new(),
            most: 1.0,
        }
    }

    fn finding(&self, finding: &Finding) -> EffectFinding {
        let effect = LIBRARY[finding.number];
        let mut parameters: Map<String, Json> = finding
            .estimate
            .as_ref()
            .map(|estimate| {
                effect
                    .parameters(self.rig, &finding.shape, estimate)
                    .iter()
                    .map(|p| (p.name.to_owned(), parameter(p)))
                    .collect()
            })
            .unwrap_or_default();
        // Events and their rate: one follows from the other by the campaign's length, which an effect does not know.
        let revolutions = self.grid.plan.revolutions.max(f64::MIN_POSITIVE);
        let number = |name: &str| parameters.get(name).and_then(|entry| entry["value"].as_f64());
        if let Some(steps) = number("steps") {
            parameters
                .insert("per_rev".to_owned(), json!({"value": steps / revolutions, "std": null, "unit": "1/rev"}));
        } else if let Some(per_rev) = number("per_rev") {
            parameters
                .insert("steps".to_owned(), json!({"value": (per_rev * revolutions).round(), "std": null, "unit": ""}));
        }
        EffectFinding {
            name: effect.name().to_owned(),
            probability: finding.probability,
            parameters,
            shrink: finding.shrink.filter(|s| s.is_finite()),
            component: effect.component().to_owned(),
            confused_with: finding.confusable.iter().map(|(n, _)| LIBRARY[*n].name().to_owned()).collect(),
            rms_rad: finding.rms_rad,
        }
    }

    /// Groups and what is named.
    fn verdict(&self, findings: &[Finding], posterior: &Posterior, best: &Model) -> Named {
        let mut identical = Vec::new();
        let mut groups = Vec::new();
        let mut verdict = Vec::new();
        let mut done: Vec<usize> = Vec::new();
        for finding in findings {
            // A member of a group that was named before, or one that could only stand in for it.
            if done.contains(&finding.number) || finding.confusable.iter().any(|(n, _)| done.contains(n)) {
                continue;
            }
            let members: Vec<usize> =
                std::iter::once(finding.number).chain(finding.confusable.iter().map(|(n, _)| *n)).collect();
            let probability = if finding.block.is_none() {
                finding.probability
            } else {
                self.models
                    .iter()
                    .zip(&posterior.weights)
                    .filter(|(m, _)| {
                        m.fit.set.iter().any(|b| {
                            matches!(&self.design.blocks[*b].candidate, Candidate::Effect { number, .. } if members.contains(number))
                        })
                    })
                    .map(|(_, w)| w)
                    .sum::<f64>()
                    .min(1.0)
            };
            let probability = probability.min(finding.most);
            let in_best = finding.block.is_none()
                || best.fit.set.iter().any(
                    |b| matches!(&self.design.blocks[*b].candidate, Candidate::Effect { number, .. } if members.contains(number)),
                );
            if members.len() > 1 {
                if probability < 0.02 {
                    continue;
                }
                let angle_deg = finding.confusable.iter().map(|(_, a)| *a).fold(0.0, f64::max);
                let names: Vec<String> = members.iter().map(|n| LIBRARY[*n].name().to_owned()).collect();
                if angle_deg < IDENTICAL_DEG {
                    identical.push((members.clone(), probability));
                }
                groups.push(Group { members: names.clone(), angle_deg, probability });
                done.extend(&members);
                if probability > NAMED && in_best {
                    verdict.push(Verdict::Group { members: names, angle_deg });
                }
            } else if probability > NAMED && in_best {
                done.push(finding.number);
                verdict.push(Verdict::Name(LIBRARY[finding.number].name().to_owned()));
            }
        }
        Named { groups, verdict, identical }
    }

    fn unknown(&self, posterior: &Posterior, best: &Model, floor_rad: f64, lines_rad2: f64) -> Unknown {
        let mut square = 0.0;
        let mut known = 0.0;
        let mut strongest: Option<(f64, &Pattern)> = None;
        for (n, b) in best.fit.set.iter().enumerate() {
            let size = best.fit.rms_rad(&self.design, n).powi(2);
            match &self.design.blocks[*b].candidate {
                Candidate::Unknown(pattern) => {
                    square += size;
                    if strongest.as_ref().is_none_or(|(s, _)| size > *s) {
                        strongest = Some((size, pattern));
                    }
                }
                Candidate::Effect { .. } => known += size,
            }
        }
        // A resonance that was found rings whenever anything excites it; faster than the bins show, it cannot be told from knocks.
        let slowest_hz = self.grid.plan.speeds_rad_per_s.first().map_or(0.0, |speed| speed / std::f64::consts::TAU);
        let shown_hz = 0.5 * self.grid.bins as f64 * slowest_hz;
        let own = |transients: &&Transients| {
            self.rings_hz(best).any(|(_, hz)| hz > shown_hz || (transients.ring_hz / hz).ln().abs() < SAME_RING)
        };
        let transients = self.aside.transients.as_ref().filter(|transients| !own(transients));
        square += self.aside.tones_rad2() + transients.map_or(0.0, |transients| transients.mean_square_rad2);
        let rms_rad = square.sqrt();
        let least_rad = least_rad(known.max(lines_rad2), self.rings_rad2(best), floor_rad);
        if let Some(transients) = transients.filter(|transients| transients.mean_square_rad2.sqrt() > least_rad) {
            let description = format!(
                "{} knocks or lost readings of up to {:.0} urad, the first at {:.2} s",
                transients.count,
                transients.peak_rad * 1e6,
                transients.first_s
            );
            let signature = Signature::steady(Carrier::None, Parity::Mixed);
            let location = Some(UnknownLocation { description, signature });
            return Unknown { probability: EVENT_PROBABILITY, rms_rad, location };
        }
        if let Some(tone) = self.aside.tones.first().filter(|tone| tone.amplitude_rad > least_rad) {
            let pattern = Pattern::Tone { frequency_hz: tone.frequency_hz };
            let location = Some(UnknownLocation { description: pattern.describe(), signature: pattern.signature() });
            return Unknown { probability: EVENT_PROBABILITY, rms_rad, location };
        }
        // Effects are linearised and their shapes lie on grids: a small part of them may stay behind. Scatter wanders too.
        let of_floor = match strongest {
            Some((_, Pattern::RandomWalk { .. })) => WANDERS_OF_FLOOR,
            Some((_, Pattern::Step { .. })) => STEPS_OF_FLOOR,
            _ => 0.0,
        };
        let least_rad = least_rad.max(of_floor * floor_rad);
        let inexact = square > 0.0 && rms_rad < least_rad;
        let probability = if inexact { posterior.unknown.min(INEXACT_PROBABILITY) } else { posterior.unknown };
        let location = strongest
            .filter(|_| probability > 0.1)
            .map(|(_, pattern)| UnknownLocation { description: pattern.describe(), signature: pattern.signature() });
        Unknown { probability: probability.min(1.0), rms_rad, location }
    }

    /// Where in a model's set resonances stand, and their frequencies, Hz.
    fn rings_hz(&self, model: &Model) -> impl Iterator<Item = (usize, f64)> {
        (0..model.fit.set.len()).filter_map(|n| match &self.design.blocks[model.fit.set[n]].candidate {
            Candidate::Effect { effect, shape, .. } => Some((n, effect.rings_hz(shape, &self.raw(model, n))?)),
            Candidate::Unknown(_) => None,
        })
    }

    /// Mean square of the resonances in a model, rad².
    fn rings_rad2(&self, model: &Model) -> f64 {
        self.rings_hz(model).map(|(n, _)| model.fit.rms_rad(&self.design, n).powi(2)).sum()
    }

    /// Shares of the reducible gap: each effect's part of the whole fitted trace.
    fn budget(&self, best: &Model, lines: &[LineError], reducible: f64) -> Vec<crate::diagnosis::BudgetRow> {
        use crate::diagnosis::BudgetRow;
        let mut rows = Vec::new();
        if reducible <= 0.0 {
            return rows;
        }
        let columns = &best.fit.columns;
        let covariance = |a: std::ops::Range<usize>, beta: &dyn Fn(usize) -> f64| -> f64 {
            a.map(|m| {
                (1..columns.len())
                    .map(|n| beta(m) * beta(n) * self.design.covariance(columns[m], columns[n]))
                    .sum::<f64>()
            })
            .sum()
        };
        let mean = |n: usize| best.fit.mean[n];
        let of_amplitudes = evidence::covariance(&self.design, &self.whitened, &best.fit);
        let mut explained = 0.0;
        for (n, b) in best.fit.set.iter().enumerate() {
            let place = best.fit.place(&self.design, n);
            let share = covariance(place.clone(), &mean) / reducible;
            let deviation = place.clone().map(|m| of_amplitudes[(m, m)]).sum::<f64>().sqrt()
                * 2.0
                * (share.abs() / reducible).sqrt();
            explained += share;
            let effect = match &self.design.blocks[*b].candidate {
                Candidate::Effect { effect, .. } => effect.name().to_owned(),
                Candidate::Unknown(pattern) => format!("unknown: {}", pattern.describe()),
            };
            rows.push(BudgetRow {
                effect,
                share,
                interval: Some([share - 1.645 * deviation, share + 1.645 * deviation]),
            });
        }
        for line in lines {
            let share = line.explained_rad2 / self.grid.samples / reducible;
            explained += share;
            let effect = INTERPOLATION[line.encoder].to_owned();
            match rows.iter_mut().find(|row| row.effect == effect) {
                Some(row) => row.share += share,
                None => rows.push(BudgetRow { effect, share, interval: None }),
            }
        }
        rows.sort_by(|a, b| b.share.total_cmp(&a.share));
        rows.push(BudgetRow { effect: "unexplained".to_owned(), share: 1.0 - explained, interval: None });
        rows
    }

    /// The effects of the verdict with their amplitudes; of a group its most probable member.
    fn found(&self, findings: &[Finding], verdict: &[Verdict]) -> Found {
        let effects = verdict
            .iter()
            .filter_map(|item| {
                let names: Vec<&str> = match item {
                    Verdict::Name(name) => vec![name],
                    Verdict::Group { members, .. } => members.iter().map(String::as_str).collect(),
                };
                findings.iter().find(|f| names.contains(&LIBRARY[f.number].name())).and_then(|f| {
                    Some(FoundEffect {
                        effect: LIBRARY[f.number],
                        shape: f.shape.clone(),
                        estimate: f.estimate.clone()?,
                    })
                })
            })
            .collect();
        Found { rig: Some(self.rig.clone()), effects }
    }

    fn confusability(&self, findings: &[Finding], best: &Model) -> Confusability {
        let mut chosen: Vec<&Finding> = findings.iter().filter(|f| f.block.is_some()).collect();
        // Those that matter first: in the model or probable; then the rest up to a readable table.
        chosen.sort_by_key(|f| !f.block.is_some_and(|b| best.fit.set.contains(&b)));
        chosen.truncate(16);
        let names = chosen.iter().map(|f| LIBRARY[f.number].name().to_owned()).collect();
        let angle_deg = chosen
            .iter()
            .map(|a| {
                chosen
                    .iter()
                    .map(|b| match (a.block, b.block) {
                        (Some(a), Some(b)) if a != b => posterior::angle_deg(&self.design, &self.whitened, a, b),
                        _ => 0.0,
                    })
                    .collect()
            })
            .collect();
        Confusability { names, angle_deg }
    }

    /// Sums of two named effects that a third could feign, and the other way round.
    fn mimics(&self, findings: &[Finding], verdict: &[Verdict]) -> Vec<String> {
        let named: Vec<&Finding> = findings.iter().filter(|f| f.block.is_some() && f.probability > 0.3).collect();
        let mut warnings = Vec::new();
        if verdict.is_empty() {
            return warnings;
        }
        for target in findings.iter().filter(|f| f.probability < 0.3 && f.block.is_some()) {
            let Some(block) = target.block else { continue };
            if self.design.blocks[block].width() > 4 {
                continue;
            }
            for (n, a) in named.iter().enumerate() {
                for b in &named[n + 1..] {
                    let (Some(x), Some(y)) = (a.block, b.block) else { continue };
                    if self.design.blocks[x].width() + self.design.blocks[y].width() > 8 {
                        continue;
                    }
                    // Where one alone looks like it, or both are one group, the sum says nothing new.
                    let near =
                        |m: usize, n: usize| posterior::angle_deg(&self.design, &self.whitened, m, n) < MIMIC_DEG;
                    if near(block, x) || near(block, y) || near(x, y) || warnings.len() >= MOST_MIMICS {
                        continue;
                    }
                    if self.angle_to_sum_deg(block, x, y) < MIMIC_DEG {
                        warnings.push(format!(
                            "{} + {} together can look like {} under this plan: their sum stands under 4 deg from it",
                            LIBRARY[a.number].name(),
                            LIBRARY[b.number].name(),
                            LIBRARY[target.number].name()
                        ));
                    }
                }
            }
        }
        warnings
    }

    /// Largest angle from a block to the sum of two others, deg.
    fn angle_to_sum_deg(&self, target: usize, a: usize, b: usize) -> f64 {
        let g = &self.whitened.gram;
        let zero = g[(1, 1)];
        let entry = |m: usize, n: usize| g[(m, n)] - g[(m, 1)] * g[(n, 1)] / zero;
        let sum: Vec<usize> =
            self.design.blocks[a].columns.clone().chain(self.design.blocks[b].columns.clone()).collect();
        let own: Vec<usize> = self.design.blocks[target].columns.clone().collect();
        let part = |rows: &[usize], columns: &[usize]| {
            nalgebra::DMatrix::from_fn(rows.len(), columns.len(), |m, n| entry(rows[m], columns[n]))
        };
        let mut gram = part(&sum, &sum);
        let ridge = 1e-10 * gram.diagonal().max();
        for n in 0..sum.len() {
            gram[(n, n)] += ridge;
        }
        let (Some(ls), Some(lo)) = (nalgebra::Cholesky::new(gram), nalgebra::Cholesky::new(part(&own, &own))) else {
            return 90.0;
        };
        let Some(left) = ls.l().solve_lower_triangular(&part(&sum, &own)) else { return 90.0 };
        let Some(both) = lo.l().solve_lower_triangular(&left.transpose()) else { return 90.0 };
        let smallest = both.singular_values().iter().copied().fold(1.0, f64::min);
        smallest.clamp(0.0, 1.0).acos().to_degrees()
    }
}

fn findings_for_next(findings: &[Finding], groups: &[Group]) -> experiment_design::Open {
    experiment_design::Open {
        groups: groups.iter().filter(|g| g.probability > 0.2).map(|g| g.members.clone()).collect(),
        unsure: findings
            .iter()
            .filter(|f| f.probability > 0.05 && f.probability < 0.95 && f.confusable.is_empty())
            .map(|f| LIBRARY[f.number].name().to_owned())
            .collect(),
    }
}

/// A parameter as the contract writes it.
fn parameter(parameter: &Parameter) -> Json {
    let value = match &parameter.value {
        Value::Number(x) => json!(x),
        Value::Table(values) => json!(values),
        Value::Text(text) => json!(text),
    };
    // Traces are linearised and evaluated at bins: what the fit is sure of to less than that, it is not.
    let std = match (&parameter.value, parameter.std) {
        (Value::Number(x), Some(std)) => {
            // A phase has no size of its own.
            let inexact = if parameter.name.starts_with("ph") { LINEARISED } else { LINEARISED * x.abs() };
            Some(if std > 0.0 { (WIDER * std).hypot(inexact) } else { std })
        }
        (_, std) => std,
    };
    json!({"value": value, "std": std, "unit": parameter.unit})
}
