//! Plans of many graphs at many sizes.

use aonet::Size;
use aonet::frame::MAX_SIDE;
use aonet::internals::graph::Graph;
use aonet::internals::kernel::TAPS;
use aonet::internals::plan::{Buffer, ConvStep, HeadStep, Layout, Lifetime, Plan, Resample, Step};
use aonet::net::{Features, KernelWeights, ModelConfig, Output, SearchConfig};
use aonet::search::{AgtaoParams, ArcsParams};
use proptest::prelude::*;

fn plan(config: &ModelConfig, size: Size) -> Plan {
    Plan::new(&Graph::new(config).unwrap(), size).unwrap()
}

/// What a step reads.
fn reads(step: &Step) -> Vec<usize> {
    match step {
        Step::Surfels { .. } => vec![],
        Step::Search { surfels, .. } => surfels.iter().flatten().copied().collect(),
        Step::Filter { input, .. } => vec![*input],
        Step::Smooth { base, .. } => base.iter().copied().collect(),
        Step::Features { search, .. } => search.iter().copied().collect(),
        Step::Survey { surfels, .. } => surfels.to_vec(),
        Step::Conv(ConvStep { sources, .. }) => sources.iter().map(|s| s.buffer).collect(),
        Step::Head(HeadStep { input, guide, base, .. }) => {
            [*input, *guide].into_iter().chain(*base).collect()
        }
        Step::Image { input } => vec![*input],
    }
}

/// What a step writes into the arena.
fn writes(step: &Step) -> Vec<usize> {
    match step {
        Step::Surfels { outputs } => outputs.to_vec(),
        Step::Search { output, .. }
        | Step::Filter { output, .. }
        | Step::Smooth { read: output, .. }
        | Step::Features { output, .. }
        | Step::Survey { output, .. }
        | Step::Conv(ConvStep { output, .. }) => vec![*output],
        Step::Head(_) | Step::Image { .. } => vec![],
    }
}

/// Plays a plan on an arena that remembers which buffer wrote each value, and says which read found another's.
fn first_overwritten_read(plan: &Plan) -> Option<(usize, usize)> {
    let mut owner = vec![usize::MAX; plan.arena_len];
    for (i, step) in plan.steps.iter().enumerate() {
        for output in writes(step) {
            owner[plan.buffers[output].range()].fill(output);
        }
        let spoilt = |id: &usize| owner[plan.buffers[*id].range()].iter().any(|o| o != id);
        if let Some(id) = reads(step).into_iter().find(spoilt) {
            return Some((i, id));
        }
    }
    None
}

fn any_config() -> impl Strategy<Value = ModelConfig> {
    let kernel =
        prop_oneof![Just(KernelWeights::Off), Just(KernelWeights::Linear), Just(KernelWeights::Softmax)];
    let features = prop_oneof![
        Just(Features::normal()),
        Just(Features::normal_depth()),
        Just(Features::normal_radius_horizon())
    ];
    // Passes of the filter, where there is a search, and whether it is corrected, and smoothed.
    let search = (0u32..=4, any::<bool>(), any::<bool>());
    let patch = prop_oneof![Just(1), Just(2), Just(4), Just(8)];
    (1usize..=4, patch, kernel, features, search).prop_flat_map(
        |(levels, patch, kernel, features, search)| {
            let widths = prop::collection::vec(1usize..=40, 2 * levels - 1);
            widths.prop_map(move |mut encoder| {
                let decoder = encoder.split_off(levels);
                let (denoise_passes, corrects, smooths) = search;
                let output = if corrects { Output::Correction } else { Output::Visibility };
                let agtao = AgtaoParams { denoise_passes, ..AgtaoParams::default() };
                let search = (corrects || features.horizon().is_some()).then_some(SearchConfig::Agtao(agtao));
                let features = features.clone();
                ModelConfig {
                    patch,
                    kernel,
                    features,
                    output,
                    search,
                    smooth: smooths && corrects && denoise_passes > 0,
                    encoder,
                    decoder,
                    ..ModelConfig::paper()
                }
            })
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_arena_never_overlaps_what_is_still_read(config in any_config(), width in 1usize..90, height in 1usize..60) {
        let plan = plan(&config, Size::px(width, height));
        prop_assert_eq!(first_overwritten_read(&plan), None);
        prop_assert!(plan.buffers.iter().all(|b| b.range().end <= plan.arena_len));
        prop_assert_eq!(plan.steps.iter().filter(|s| matches!(s, Step::Head(_))).count(), 1);
        prop_assert!(plan.padded.width() >= width && plan.padded.height() >= height);
    }
}

#[test]
fn an_overlap_would_be_noticed() {
    let mut plan = plan(&ModelConfig::paper(), Size::px(64, 64));
    assert_eq!(first_overwritten_read(&plan), None);
    plan.buffers[2].offset = plan.buffers[0].offset;
    assert!(first_overwritten_read(&plan).is_some());
}

#[test]
fn the_papers_network_is_features_fourteen_convolutions_and_a_head() {
    let plan = plan(&ModelConfig::paper(), Size::px(1280, 720));
    assert_eq!(plan.padded, Size::px(1280, 736));
    assert_eq!(plan.steps.len(), 16);
    assert!(matches!(plan.steps[0], Step::Features { patch: 4, .. }));
    assert!(matches!(plan.steps[15], Step::Head(HeadStep { patch: 4, kernel: KernelWeights::Linear, .. })));
    let resamples: Vec<_> = plan
        .steps
        .iter()
        .filter_map(|step| match step {
            Step::Conv(ConvStep { sources, .. }) => {
                Some(sources.iter().map(|s| s.resample).collect::<Vec<_>>())
            }
            Step::Surfels { .. }
            | Step::Search { .. }
            | Step::Filter { .. }
            | Step::Smooth { .. }
            | Step::Features { .. }
            | Step::Survey { .. }
            | Step::Head(_)
            | Step::Image { .. } => None,
        })
        .collect();
    let (none, pool, up) = (Resample::None, Resample::AvgPool(2), Resample::Upsample2);
    let double = |first: &[Resample]| [first.to_vec(), vec![none]];
    let expected = [
        double(&[none]),
        double(&[pool]),
        double(&[pool]),
        double(&[pool]),
        double(&[up, none]),
        double(&[up, none]),
        double(&[up, none]),
    ];
    assert_eq!(resamples, expected.concat());
}

#[test]
fn a_search_is_steps_of_its_own() {
    let plan = plan(&ModelConfig::correcting(), Size::px(1280, 720));
    let search = SearchConfig::tuned();
    let Step::Filter { input, output: found, .. } = plan.steps[1] else { panic!("{:?}", plan.steps[1]) };
    assert_eq!(plan.steps[0], Step::Search { search, surfels: None, output: input });
    assert!(matches!(plan.steps[2], Step::Features { search: Some(shown), patch: 4, .. } if shown == found));
    let last = plan.steps.len() - 1;
    let Step::Head(HeadStep { base, kernel: KernelWeights::Off, .. }) = plan.steps[last] else {
        panic!("no head")
    };
    assert_eq!((base, plan.buffers[found].live), (Some(found), Lifetime { first: 1, last }));
    // The frame's size, not the padded one.
    assert_eq!((plan.padded, plan.buffers[found].len()), (Size::px(1280, 768), 1280 * 720));
}

#[test]
fn bent_normals_are_three_more_planes_of_the_search() {
    let arcs = ModelConfig {
        search: Some(SearchConfig::Arcs(ArcsParams::default())),
        output: Output::Shares,
        features: Features::normal_radius_light(),
        ..ModelConfig::correcting()
    };
    for (config, planes) in [(ModelConfig::correcting(), 1), (arcs, 6)] {
        let (graph, size) = (Graph::new(&config).unwrap(), Size::px(1280, 720));
        let (plan, bent) = Plan::with_bent_normals(&graph, size).unwrap();
        assert_eq!(
            (plan.buffers[bent].channels, plan.buffers[bent].live.last),
            (planes + 3, plan.steps.len())
        );
        let searches = |plan: &Plan| plan.steps.iter().filter(|s| matches!(s, Step::Search { .. })).count();
        assert_eq!((searches(&plan), first_overwritten_read(&plan)), (1, None));
    }
}

#[test]
fn smoothing_follows_the_head() {
    let plan = plan(&ModelConfig::balanced(), Size::px(1280, 720));
    let last = plan.steps.len() - 1;
    let Step::Head(HeadStep { base: Some(found), .. }) = plan.steps[last - 1] else { panic!("no head") };
    let Step::Smooth { base, read, .. } = plan.steps[last] else { panic!("no smoothing") };
    assert_eq!((base, plan.buffers[found].live.last), (Some(found), last));
    assert_eq!((plan.buffers[read].channels, plan.buffers[read].live), (1, Lifetime { first: last, last }));
    assert_eq!(first_overwritten_read(&plan), None);
}

#[test]
fn the_arena_has_no_room_for_kernels() {
    let paper = plan(&ModelConfig::paper(), Size::px(1280, 720));
    let kernels = TAPS * paper.padded.pixels();
    assert!(4 * paper.arena_len < kernels, "{} values for {kernels} kernel weights", paper.arena_len);
    let full = plan(&ModelConfig { patch: 1, ..ModelConfig::paper() }, Size::px(640, 360));
    let kernels = TAPS * full.padded.pixels();
    assert!(full.buffers.iter().all(|b| b.len() < kernels), "a buffer could hold {kernels} kernel weights");
}

#[test]
fn buffers_have_whole_blocks_and_a_halo() {
    let live = Lifetime { first: 0, last: 0 };
    let buffer = Buffer { offset: 5, layout: Layout::Blocked, channels: 17, height: 3, width: 4, live };
    assert_eq!((buffer.row_len(), buffer.len(), buffer.range()), (32 * 6, 3 * 32 * 6, 5..5 + 3 * 32 * 6));
    assert_eq!(Buffer { layout: Layout::Planar, ..buffer.clone() }.row_len(), 17 * 6);
    assert_eq!(Buffer { layout: Layout::Image, ..buffer }.row_len(), 17 * 4);
}

#[test]
fn memory_is_reused_and_traffic_is_counted() {
    let plan = plan(&ModelConfig::paper(), Size::px(1280, 720));
    let all: usize = plan.buffers.iter().map(Buffer::len).sum();
    let live_at =
        |step: usize| plan.buffers.iter().filter(move |b| (b.live.first..=b.live.last).contains(&step));
    let needed =
        (0..plan.steps.len()).map(|step| live_at(step).map(Buffer::len).sum::<usize>()).max().unwrap();
    // First fit wastes 16 % here.
    assert!(needed < all && plan.arena_len < needed + needed / 4, "{} for {needed} of {all}", plan.arena_len);
    let written: usize = 4 * all + 4 * 1280 * 720;
    assert!(plan.traffic_bytes() > 2 * written && plan.traffic_bytes() < 3 * written);
}

#[test]
fn impossible_sizes_are_refused_and_the_largest_have_plans() {
    for (width, height) in [(0, 4), (4, 0), (40_000, 4)] {
        let error = Size::new(width, height).unwrap_err().to_string();
        assert!(error.contains(&format!("{width}x{height}")), "{error}");
    }
    for config in [ModelConfig::paper(), ModelConfig::correcting(), ModelConfig::deep_shading()] {
        let plan = plan(&config, Size::px(MAX_SIDE - 1, 1));
        assert_eq!(plan.padded.width(), MAX_SIDE);
        let full = Plan::new(&Graph::new(&config).unwrap(), Size::px(MAX_SIDE, MAX_SIDE)).unwrap();
        assert!(full.arena_len >= MAX_SIDE * MAX_SIDE);
    }
}
