//! Peak memory of this process, if the system reports it (Linux).

/// Largest resident size of this process (MiB) since it started, or since [`reset_peak`].
pub fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// Resets the peak, so that [`peak_mib`] covers the time from now on. If the system does not allow it, a peak covers
/// the whole life of the process: it may be too high, never too low.
pub fn reset_peak() {
    // proc_pid_clear_refs(5): 5 sets the peak to the current size.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_was_touched_counts() {
        let Some(before) = peak_mib() else {
            eprintln!("skipped: the system does not tell");
            return;
        };
        // More than other tests of this process hold beside it.
        let touched = std::hint::black_box(vec![1u8; 512 << 20]);
        let held = peak_mib().unwrap();
        assert!(held >= 512.0, "{held} MiB after {before}");
        drop(touched);
        // Linux counts pages by the batch: a peak may be off by a few.
        assert!(peak_mib().unwrap() > held - 4.0, "a peak does not sink by itself");
        reset_peak();
        assert!(peak_mib().unwrap() < held - 256.0, "a peak can be forgotten");
    }
}
