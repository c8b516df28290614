//! Figures that are bars: sensitivity of the input channels, cost of the levels.

use super::claims::Claim;
use super::layers::{self, Cost, Level};
use super::rows::{self, HD};
use super::{Content, Item, Section, Subject};
use crate::plot::{Bars, bars};
use crate::sensitivity::{self, Sensitivity};
use aonet::internals::graph::Graph;
use aonet::internals::weights::Weights;
use aonet::net::{Model, TrainingFacts};
use aonet_scene::error::{Error, Result};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// The network of the paper's Fig. 2.
const NORMALIZED: &str = "normal_depth_normalized";

/// Fig. 2 for the first seed of every network.
pub(super) fn sensitivity(subject: &Subject<'_>, progress: &dyn Fn(&str, usize, usize)) -> Result<Section> {
    let item = Item::Fig2;
    let Some(manifest) = subject.manifest else {
        return Err(Error::request(item.name(), "a dataset with test frames", "none"));
    };
    let keys: Vec<&str> = subject.models.keys().collect();
    let models: Vec<&Model> = keys.iter().filter_map(|k| subject.models.first(k)).collect();
    let progress = |done, total| progress("sensitivity", done, total);
    let found =
        if models.is_empty() { Vec::new() } else { sensitivity::sensitivity(&models, manifest, &progress)? };
    let by_key: BTreeMap<&str, &Sensitivity> = keys.iter().copied().zip(&found).collect();
    let chart = drawn(&by_key)?;
    let mut notes = vec![
        "Mean absolute change of the unclamped output under noise of a tenth of the channel's standard deviation, over \
         that tenth; shares of the sum (Eq. 1). First seed of every network."
            .into(),
    ];
    if keys.is_empty() {
        notes.push("No network: not trained.".into());
    }
    Ok(Section {
        item,
        content: Content::Chart(chart),
        claims: vec![depth_share(by_key.get(NORMALIZED).copied())],
        notes,
        json: json!({ "networks": by_key }),
    })
}

/// Fig. 2: depth "has little effect on network results, less than 10 %".
fn depth_share(found: Option<&Sensitivity>) -> Claim {
    let share = found.and_then(|s| s.channels.get(3)).map(|c| c.relative);
    let ours = share.map(|s| (s < 0.1, format!("{:.1} %", 100.0 * s)));
    Claim::new("§3.1: the share of normalised depth is less than 10 %", ours)
}

fn drawn(by_key: &BTreeMap<&str, &Sensitivity>) -> Result<String> {
    let groups: Vec<Vec<String>> =
        by_key.values().map(|s| s.channels.iter().map(|c| c.name.clone()).collect()).collect();
    let series: Vec<[(String, Vec<Option<f64>>); 1]> = by_key
        .values()
        .map(|s| [(String::new(), s.channels.iter().map(|c| Some(100.0 * c.relative)).collect())])
        .collect();
    let titles: Vec<String> = by_key.keys().map(|key| rows::short_label(key)).collect();
    let values = series.iter().flat_map(|[(_, values)]| values).flatten();
    let full = values.copied().reduce(f64::max);
    let label = |v: f64| format!("{v:.1} %");
    let charts: Vec<Bars<'_>> = titles
        .iter()
        .zip(groups.iter().zip(&series))
        .map(|(title, (groups, series))| Bars { title, groups, series, full, label })
        .collect();
    bars(&charts, 2)
}

/// Fig. 3: milliseconds and multiply-accumulates of every level, with and without patches.
pub(super) fn layers(subject: &Subject<'_>) -> Result<Section> {
    let keys = ["base", "base_patch"];
    let mut costs = Vec::new();
    let mut notes = Vec::new();
    for key in keys {
        let model = match subject.models.first(key) {
            Some(model) => model.clone(),
            None => {
                let label = rows::short_label(key);
                notes.push(format!(
                    "{label}: not trained; random weights of its configuration, which take the same time."
                ));
                random(key)?
            }
        };
        costs.push(layers::costs(&model, HD, subject.threads, subject.runs)?);
    }
    let levels: BTreeSet<&Level> = costs.iter().flat_map(BTreeMap::keys).collect();
    let groups: Vec<String> = levels.iter().map(|l| l.name()).collect();
    let series = |of: fn(&Cost) -> f64| -> Vec<(String, Vec<Option<f64>>)> {
        let one = |(key, costs): (&str, &BTreeMap<Level, Cost>)| {
            let total: f64 = costs.values().map(of).sum();
            let values = levels.iter().map(|l| costs.get(l).map(of)).collect();
            (format!("{}, {total:.1} in all", rows::short_label(key)), values)
        };
        keys.into_iter().zip(&costs).map(one).collect()
    };
    let (ms, macs) = (series(|c| c.ms), series(|c| c.macs / 1e9));
    let label = |v: f64| if v < 10.0 { format!("{v:.1}") } else { format!("{v:.0}") };
    let chart = |title, series| Bars { title, groups: &groups, series, full: None, label };
    let svg = bars(&[chart("milliseconds", &ms), chart("thousand million multiply-accumulates", &macs)], 1)?;
    notes.push(
        "1:s is a level with a cell for s x s pixels; enc and dec are its two convolutions down and up."
            .into(),
    );
    let networks: BTreeMap<&str, Value> = keys.into_iter().zip(costs.iter().map(as_json)).collect();
    let json = json!({ "size": HD.to_string(), "networks": networks });
    let claims = layer_claims(&costs[0], &costs[1]);
    Ok(Section { item: Item::Fig3, content: Content::Chart(svg), claims, notes, json })
}

fn layer_claims(base: &BTreeMap<Level, Cost>, patch: &BTreeMap<Level, Cost>) -> Vec<Claim> {
    let total = |costs: &BTreeMap<Level, Cost>| costs.values().map(|c| c.ms).sum::<f64>();
    let first = |level: &Level| matches!(level, Level::Encoder(1) | Level::Decoder(std::cmp::Reverse(1)));
    let share = base.iter().filter(|(l, _)| first(l)).map(|(_, c)| c.ms).sum::<f64>() / total(base);
    let ratio = total(patch) / total(base);
    let percent = |v: f64| format!("{:.0} %", 100.0 * v);
    vec![
        Claim::new(
            "§3.2: the first level takes more than half of the time without patches (11.61 of 20.56 ms)",
            Some((share > 0.5, percent(share))),
        ),
        Claim::new(
            "§3.2: with patches all takes 18 % of the time (at most 20 %)",
            Some((ratio <= 0.2, percent(ratio))),
        ),
    ]
}

fn as_json(costs: &BTreeMap<Level, Cost>) -> Value {
    costs.iter().map(|(level, cost)| (level.name(), json!(cost))).collect::<serde_json::Map<_, _>>().into()
}

/// A network of a row's configuration with random weights.
fn random(key: &str) -> Result<Model> {
    let config = rows::untrained_config(key)
        .ok_or_else(|| Error::request(key, "a row of Table 4", "no configuration of it"))?;
    let weights = Weights::init(&Graph::new(&config)?, 1);
    Ok(Model::new(config, weights, TrainingFacts::default())?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::claims::Verdict;
    use crate::sensitivity::ChannelSensitivity;

    #[test]
    fn the_share_of_depth_decides() {
        let with = |relative| {
            let channel = |r| ChannelSensitivity { name: "c".into(), sigma: 1.0, absolute: r, relative: r };
            let normal = (1.0 - relative) / 3.0;
            Sensitivity {
                channels: [normal, normal, normal, relative].map(channel).to_vec(),
                crops: 1,
                pixels: 1,
            }
        };
        assert_eq!(depth_share(Some(&with(0.05))).verdict, Verdict::Reproduced);
        assert_eq!(depth_share(Some(&with(0.4))).verdict, Verdict::NotReproduced);
        assert_eq!(depth_share(None).verdict, Verdict::NotMeasured);
    }

    #[test]
    fn the_share_of_the_first_level_decides() {
        let cost = |ms| Cost { ms, macs: 1.0 };
        let base = |first: f64| {
            BTreeMap::from([
                (Level::Encoder(1), cost(first)),
                (Level::Decoder(std::cmp::Reverse(2)), cost(10.0)),
            ])
        };
        let patch = BTreeMap::from([(Level::Encoder(4), cost(3.0))]);
        let verdicts =
            |first| layer_claims(&base(first), &patch).iter().map(|c| c.verdict).collect::<Vec<_>>();
        assert_eq!(verdicts(11.0), [Verdict::Reproduced; 2]);
        assert_eq!(verdicts(4.0), [Verdict::NotReproduced; 2]);
    }
}
