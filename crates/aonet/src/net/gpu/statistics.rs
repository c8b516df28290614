//! What a driver's compiler makes of the shaders. Mesa's for AMD's processors needs none of them:
//!
//! ```sh
//! RADV_FORCE_FAMILY=NAVI31 VK_DRIVER_FILES=/usr/share/vulkan/icd.d/radeon_icd.x86_64.json \
//!     cargo test -p aonet --features gpu --lib what_a_compiler_makes -- --ignored --nocapture
//! ```
#![allow(unsafe_code, reason = "Vulkan tells statistics of pipelines, wgpu does not")]

use crate::gpu::matrices::Matrices;
use crate::gpu::options::{Kernels, Precision};
use crate::gpu::program::Arithmetic;
use crate::gpu::shader::Shader;
use crate::net::config::KernelWeights;
use crate::net::gpu::conv::Kind;
use crate::net::gpu::head;
use crate::net::gpu::head::kind::HeadKind;
use crate::net::graph::Activation;
use crate::net::plan::Resample;
use ash::{khr, vk};
use std::collections::BTreeMap;
use std::ffi::CStr;
use wgpu::naga;
use wgpu::naga::back::spv;
use wgpu::naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};

/// A driver that compiles.
struct Driver {
    _entry: ash::Entry,
    device: ash::Device,
    executable: khr::pipeline_executable_properties::Device,
    name: String,
}

impl Driver {
    fn open() -> Self {
        let priority = [1.0];
        let queue = [vk::DeviceQueueCreateInfo::default().queue_priorities(&priority)];
        let extensions = [khr::pipeline_executable_properties::NAME, khr::cooperative_matrix::NAME];
        let extensions = extensions.map(CStr::as_ptr);
        let mut executable = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
            .pipeline_executable_info(true);
        let mut matrices = vk::PhysicalDeviceCooperativeMatrixFeaturesKHR::default().cooperative_matrix(true);
        let mut halves = vk::PhysicalDeviceVulkan11Features::default().storage_buffer16_bit_access(true);
        let mut model = vk::PhysicalDeviceVulkan12Features::default()
            .shader_float16(true)
            .vulkan_memory_model(true)
            .vulkan_memory_model_device_scope(true);
        let asked = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queue)
            .enabled_extension_names(&extensions)
            .push_next(&mut executable)
            .push_next(&mut matrices)
            .push_next(&mut halves)
            .push_next(&mut model);
        let version = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let application = vk::InstanceCreateInfo::default().application_info(&version);
        // SAFETY: what the structures point to lives until the end of this function, and the entry as long as the device.
        unsafe {
            let entry = ash::Entry::load().expect("a Vulkan loader");
            let instance = entry.create_instance(&application, None).expect("an instance");
            let adapter = instance.enumerate_physical_devices().expect("adapters")[0];
            let properties = instance.get_physical_device_properties(adapter);
            let name = properties.device_name_as_c_str().expect("a name").to_string_lossy().into_owned();
            let device =
                instance.create_device(adapter, &asked, None).expect("a device with statistics and matrices");
            let executable = khr::pipeline_executable_properties::Device::new(&instance, &device);
            Self { _entry: entry, device, executable, name }
        }
    }

    /// The statistics of a shader, and how many of its instructions add products, by name.
    fn compile(&self, shader: &Shader, checked: bool) -> (BTreeMap<String, u64>, BTreeMap<String, usize>) {
        let (words, bindings) = translated(shader.source(), checked);
        let bindings: Vec<_> = bindings
            .into_iter()
            .map(|(binding, kind)| {
                let new = vk::DescriptorSetLayoutBinding::default().binding(binding).descriptor_type(kind);
                new.descriptor_count(1).stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let bindings = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let module = vk::ShaderModuleCreateInfo::default().code(&words);
        let wanted = vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR
            | vk::PipelineCreateFlags::CAPTURE_INTERNAL_REPRESENTATIONS_KHR;
        // SAFETY: naga has found the module valid; all that the structures point to lives until the end of this block.
        unsafe {
            let group = [self.device.create_descriptor_set_layout(&bindings, None).expect("a layout")];
            let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&group);
            let layout = self.device.create_pipeline_layout(&layout, None).expect("a layout");
            let module = self.device.create_shader_module(&module, None).expect("a module");
            let stage = vk::PipelineShaderStageCreateInfo::default().stage(vk::ShaderStageFlags::COMPUTE);
            let stage = stage.module(module).name(c"main");
            let pipeline = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout).flags(wanted);
            let pipeline = self.device.create_compute_pipelines(vk::PipelineCache::null(), &[pipeline], None);
            let pipeline = pipeline.expect("a pipeline")[0];
            let executable = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
            let found = self.executable.get_pipeline_executable_statistics(&executable).expect("statistics");
            let number = |s: &vk::PipelineExecutableStatisticKHR<'_>| {
                (CStr::from_ptr(s.name.as_ptr()).to_string_lossy().into_owned(), s.value.u64)
            };
            (found.iter().map(number).collect(), products(&self.assembly(&executable)))
        }
    }

    /// What the compiler wrote last, as text.
    ///
    /// # Safety
    /// The pipeline must be of this device.
    unsafe fn assembly(&self, of: &vk::PipelineExecutableInfoKHR<'_>) -> String {
        let get = self.executable.fp().get_pipeline_executable_internal_representations_khr;
        let mut count = 0;
        // SAFETY: the driver is asked for the number first, then for the sizes, then for the texts, which have room.
        unsafe {
            let device = self.device.handle();
            get(device, of, &mut count, std::ptr::null_mut()).result().expect("representations");
            let mut all = vec![vk::PipelineExecutableInternalRepresentationKHR::default(); count as usize];
            get(device, of, &mut count, all.as_mut_ptr()).result().expect("their sizes");
            let mut texts: Vec<_> = all.iter().map(|one| vec![0u8; one.data_size]).collect();
            all.iter_mut().zip(&mut texts).for_each(|(one, text)| one.p_data = text.as_mut_ptr().cast());
            get(device, of, &mut count, all.as_mut_ptr()).result().expect("their texts");
            String::from_utf8_lossy(texts.last().expect("one at least")).into_owned()
        }
    }
}

/// Instructions that add products, by name.
fn products(assembly: &str) -> BTreeMap<String, usize> {
    let mut all = BTreeMap::new();
    let name = |line: &str| line.split_whitespace().next().unwrap_or_default().to_owned();
    let adds = |name: &String| ["_fma", "_pk_fma", "wmma"].iter().any(|part| name.contains(part));
    assembly.lines().map(name).filter(adds).for_each(|name| *all.entry(name).or_default() += 1);
    all
}

/// A shader as wgpu gives it to drivers that watch over buffers themselves, and its bindings.
fn translated(source: &str, checked: bool) -> (Vec<u32>, Vec<(u32, vk::DescriptorType)>) {
    let module = naga::front::wgsl::parse_str(source).expect("WGSL");
    let all = (naga::valid::ValidationFlags::all(), naga::valid::Capabilities::all());
    let info = naga::valid::Validator::new(all.0, all.1).validate(&module).expect("a valid shader");
    let kind = |space| match space {
        naga::AddressSpace::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
        _ => vk::DescriptorType::STORAGE_BUFFER,
    };
    let bindings = module
        .global_variables
        .iter()
        .filter_map(|(_, v)| Some((v.binding?.binding, kind(v.space))))
        .collect();
    let index = if checked { BoundsCheckPolicy::Restrict } else { BoundsCheckPolicy::Unchecked };
    let options = spv::Options {
        lang_version: (1, 4),
        bounds_check_policies: BoundsCheckPolicies {
            index,
            buffer: BoundsCheckPolicy::Unchecked,
            image_load: BoundsCheckPolicy::Unchecked,
            binding_array: BoundsCheckPolicy::Unchecked,
        },
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
        force_loop_bounding: checked,
        ..Default::default()
    };
    let main =
        spv::PipelineOptions { shader_stage: naga::ShaderStage::Compute, entry_point: "main".to_owned() };
    (spv::write_vec(&module, &info, &options, Some(&main)).expect("SPIR-V"), bindings)
}

#[test]
#[ignore = "needs a driver that tells statistics of pipelines, and matrices of 16x16"]
fn what_a_compiler_makes_of_the_shaders() {
    let driver = Driver::open();
    println!("{}", driver.name);
    let conv =
        |tile| Kind { sources: vec![Resample::None], size: 3, activation: Activation::LeakyRelu, tile };
    let mut shaders: Vec<_> = [Precision::F32, Precision::F16]
        .into_iter()
        .flat_map(|precision| {
            let by = Arithmetic { precision, kernels: Kernels::Plain };
            let heads = [4, 2].map(|cells| {
                (
                    format!("head, {cells} cells, {precision}"),
                    head::kind::shader(
                        by,
                        &HeadKind { patch: 4, kernel: KernelWeights::Linear, planes: 1, neighbours: vec![] },
                        cells,
                    ),
                )
            });
            let conv = (format!("convolution, 24 outputs, {precision}"), conv(24).shader(by, 2));
            std::iter::once(conv).chain(heads)
        })
        .collect();
    let matrices = Matrices { side: 16, lanes: 32, spelt_out: false };
    shaders.push(("convolution, 32 outputs, matrices".into(), conv(32).matrix_shader(matrices, [2, 2])));
    for (name, shader) in &shaders {
        for checked in [true, false] {
            let (found, products) = driver.compile(shader, checked);
            let of = |name: &str| found.get(name).map_or("-".to_owned(), u64::to_string);
            let checks = if checked { "checked" } else { "unchecked" };
            let (instructions, registers, spilled) = (of("Instructions"), of("VGPRs"), of("Spilled VGPRs"));
            println!(
                "{name}, {checks}: {instructions} instructions, {registers} registers, {spilled} spilled, {products:?}"
            );
        }
    }
}
