//! Times of passes on the device, if it supports timestamps.

use super::device::Gpu;
use super::pass_clock::PassClock;
use aonet::gpu::{Timestamps, wgpu};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Steps of a frame that are timed separately: the G-buffer, the second layer, two methods, the reference, the lighting, and
/// three of the caller.
const SETS: usize = 9;
/// Queries of each step. The largest shipped network has 22 passes.
const QUERIES: u32 = 128;
const SET_BYTES: u64 = QUERIES as u64 * 8;

/// Time of one step of a frame on the device.
#[derive(Debug, Clone, PartialEq)]
pub struct PassTime {
    /// Name of the step.
    pub label: String,
    /// From the start of its first pass to the end of its last (ms).
    pub ms: f32,
}

/// Times of a frame that are being read from the device. One frame at a time is timed.
#[derive(Debug)]
pub(super) struct Stopwatch {
    gpu: Gpu,
    sets: Vec<wgpu::QuerySet>,
    resolved: wgpu::Buffer,
    back: wgpu::Buffer,
    /// Whether the frame being encoded is timed.
    runs: bool,
    /// Labels of the frame's sets, and the number of queries that each writes.
    used: Vec<(String, u32)>,
    state: Arc<AtomicU8>,
    latest: Vec<PassTime>,
}

/// Values of the state: no frame is being read, one is, its times have arrived, or reading failed.
const IDLE: u8 = 0;
const UNDER_WAY: u8 = 1;
const READY: u8 = 2;
const FAILED: u8 = 3;

impl Stopwatch {
    pub(super) fn new(gpu: &Gpu) -> Option<Self> {
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let set = |_| {
            gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("stopwatch"),
                ty: wgpu::QueryType::Timestamp,
                count: QUERIES,
            })
        };
        let bytes = SETS as u64 * SET_BYTES;
        let resolve = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        Some(Self {
            gpu: gpu.clone(),
            sets: (0..SETS).map(set).collect(),
            resolved: gpu.buffer("stopwatch", bytes, resolve),
            back: gpu.buffer("stopwatch", bytes, wgpu::BufferUsages::MAP_READ),
            runs: false,
            used: Vec::new(),
            state: Arc::default(),
            latest: Vec::new(),
        })
    }

    /// Starts timing a new frame, unless the last one's times have not arrived yet.
    pub(super) fn start(&mut self) -> Option<&mut Self> {
        self.runs = false;
        // A lost device reports to its own handler.
        let _ = self.gpu.device.poll(wgpu::PollType::Poll);
        match self.state.load(Ordering::Acquire) {
            UNDER_WAY => return None,
            READY => self.read(),
            _ => {}
        }
        self.state.store(IDLE, Ordering::Release);
        self.used.clear();
        self.runs = true;
        Some(self)
    }

    /// Discards the frame, because its commands will not run.
    pub(super) fn stop(&mut self) {
        self.runs = false;
    }

    /// Timestamps for a pass of the frame being encoded; none if it is not timed.
    pub(super) fn pass(&mut self, label: &str) -> Option<PassClock> {
        self.set(label, 1).cloned().map(PassClock)
    }

    /// Starts timing passes that write no timestamps themselves, up to [`PassClock::end`].
    pub(super) fn begin(&mut self, encoder: &mut wgpu::CommandEncoder, label: &str) -> Option<PassClock> {
        let clock = self.pass(label)?;
        clock.write(encoder, Some(0), None);
        Some(clock)
    }

    /// Timestamps for the passes of a session.
    pub(super) fn session(&mut self, label: &str, passes: usize) -> Option<Timestamps<'_>> {
        Some(Timestamps { queries: self.set(label, passes)? })
    }

    fn set(&mut self, label: &str, passes: usize) -> Option<&wgpu::QuerySet> {
        let count = u32::try_from(2 * passes).ok().filter(|count| *count <= QUERIES && self.runs)?;
        let set = self.sets.get(self.used.len())?;
        self.used.push((label.to_owned(), count));
        Some(set)
    }

    /// Encodes the copy of the times to main memory, if the frame is timed.
    pub(super) fn finish(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if !std::mem::take(&mut self.runs) {
            return;
        }
        for ((set, (_, count)), i) in self.sets.iter().zip(&self.used).zip(0..) {
            encoder.resolve_query_set(set, 0..*count, &self.resolved, i * SET_BYTES);
        }
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.back, 0, self.resolved.size());
        let state = Arc::clone(&self.state);
        state.store(UNDER_WAY, Ordering::Release);
        encoder.map_buffer_on_submit(&self.back, wgpu::MapMode::Read, .., move |mapped| {
            state.store(if mapped.is_ok() { READY } else { FAILED }, Ordering::Release);
        });
    }

    fn read(&mut self) {
        let Ok(bytes) = self.back.get_mapped_range(..) else { return };
        let period_ms = f64::from(self.gpu.queue.get_timestamp_period()) * 1e-6;
        let tick = |at: usize| {
            bytes.get(at..at + 8).map_or(0, |b| b.iter().rev().fold(0u64, |t, b| t << 8 | u64::from(*b)))
        };
        let time = |((label, count), set): (&(String, u32), usize)| {
            let first = set * SET_BYTES as usize;
            let ticks = tick(first + 8 * (*count as usize - 1)).saturating_sub(tick(first));
            PassTime { label: label.clone(), ms: (ticks as f64 * period_ms) as f32 }
        };
        self.latest = self.used.iter().zip(0..).map(time).collect();
        drop(bytes);
        self.back.unmap();
    }

    /// Times of the last frame whose times have arrived.
    pub(super) fn latest(&self) -> &[PassTime] {
        &self.latest
    }
}
