//! Buffers on a device.

use crate::error::{Error, Result};
use crate::gpu::options::{Kernels, Precision};
use half::f16;

/// A device, and the numbers and instructions it computes with.
#[derive(Debug, Clone)]
pub(crate) struct Context {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) precision: Precision,
    pub(crate) kernels: Kernels,
}

impl Context {
    /// Bytes of one activation or weight.
    pub(crate) fn real_bytes(&self) -> usize {
        match self.precision {
            Precision::F32 => size_of::<f32>(),
            Precision::F16 => size_of::<f16>(),
        }
    }

    /// Weights in a buffer.
    ///
    /// # Errors
    /// When they are more than a shader may see.
    pub(crate) fn reals(&self, label: &str, values: &[f32]) -> Result<wgpu::Buffer> {
        match self.precision {
            Precision::F32 => self.floats(label, values),
            Precision::F16 => {
                let bytes = values.iter().flat_map(|v| f16::from_f32(*v).to_le_bytes());
                self.filled(label, &bytes.collect::<Vec<_>>(), wgpu::BufferUsages::STORAGE)
            }
        }
    }

    /// Numbers of 32 bits in a buffer.
    ///
    /// # Errors
    /// When they are more than a shader may see.
    pub(crate) fn floats(&self, label: &str, values: &[f32]) -> Result<wgpu::Buffer> {
        let bytes: Vec<_> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.filled(label, &bytes, wgpu::BufferUsages::STORAGE)
    }

    /// Whole numbers that all invocations see.
    ///
    /// # Errors
    /// When they are more than a shader may see.
    pub(crate) fn uniform(&self, label: &str, values: &[usize]) -> Result<wgpu::Buffer> {
        let bytes: Vec<_> = values.iter().flat_map(|v| (*v as u32).to_le_bytes()).collect();
        self.filled(label, &bytes, wgpu::BufferUsages::UNIFORM)
    }

    fn filled(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        // Mapping a buffer where there is no memory for it would panic; writing to it is an error.
        let buffer = self.buffer(label, contents.len(), usage | wgpu::BufferUsages::COPY_DST)?;
        self.queue.write_buffer(&buffer, 0, contents);
        Ok(buffer)
    }

    /// A buffer that shaders write.
    ///
    /// # Errors
    /// When it is larger than a shader may see.
    pub(crate) fn storage(&self, label: &str, bytes: usize) -> Result<wgpu::Buffer> {
        let copy = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        self.buffer(label, bytes, wgpu::BufferUsages::STORAGE | copy)
    }

    fn buffer(&self, label: &str, bytes: usize, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        self.check_bytes(label, bytes)?;
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes as u64,
            usage,
            mapped_at_creation: false,
        }))
    }

    fn check_bytes(&self, label: &str, bytes: usize) -> Result<()> {
        let limits = self.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        match (bytes as u64) <= most {
            true => Ok(()),
            false => {
                let expected = format!("at most {most} bytes, which is the limit of the device");
                Err(Error::device(format!("buffer of {label}"), expected, format!("{bytes} bytes")))
            }
        }
    }
}
