//! A network or a classic method at one size, with its memory and its threads.

use crate::camera::Camera;
use crate::errors;
use aonet::net::cpu::Precision;
use aonet::net::{Model, cpu, shipped};
use aonet::search::{self, Classic};
use aonet::{AoImage, AoParams, GBuffer, Margin, SecondLayer, Size, Window};
use glam::{Mat3A, Vec3A};
use numpy::PyUntypedArrayMethods;
use numpy::ndarray::Dimension;
use numpy::{Element, PyArray2, PyArrayMethods, PyReadonlyArray, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Width and height of the picture, columns and rows of its guard band on each side (px).
type Sides = (usize, usize, usize, usize);

/// Normals, depth, and depth of a second layer.
type Arrays<'py> =
    (PyReadonlyArray3<'py, f32>, PyReadonlyArray2<'py, f32>, Option<PyReadonlyArray2<'py, f32>>);

/// A method that is ready to run.
enum Engine {
    Network(cpu::Session),
    Classic(search::Session),
}

/// What a run changes.
struct State {
    engine: Engine,
    /// Normals in view space, where they come in world space.
    normals: Vec<[f32; 3]>,
    image: AoImage,
}

/// The pixels of a frame, its guard band included.
#[derive(Clone, Copy)]
struct Layers<'a> {
    normal: &'a [[f32; 3]],
    depth: &'a [f32],
    second: Option<&'a [f32]>,
}

/// A session. Two Python threads that use the same one take turns.
#[pyclass(frozen, module = "aonet._aonet")]
pub(crate) struct Session {
    /// None after a fault, and while the session is dropped.
    state: Mutex<Option<State>>,
    window: Window,
    sees_radius: bool,
    /// The process that has the threads.
    process: u32,
}

#[pymethods]
impl Session {
    /// A session of a network: of the one of that name that comes with the package, or of a file.
    #[staticmethod]
    fn network(
        py: Python<'_>,
        source: (PathBuf, bool),
        sides: Sides,
        precision: &str,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let (window, threads, precision) = (window(sides)?, available(threads)?, precision_named(precision)?);
        let (source, is_name) = source;
        let make = || -> aonet_scene::Result<_> {
            let model = if is_name { shipped_model(&source)? } else { model_file(&source)? };
            let options = cpu::Options { threads, precision, ..cpu::Options::default() };
            let engine = Engine::Network(cpu::Session::with_options(&model, window, options)?);
            Ok((engine, model.config().features.sees_radius()))
        };
        let (engine, sees_radius) = errors::detached(py, make)?.map_err(errors::file)?;
        Ok(Self::of(engine, window, sees_radius))
    }

    /// A session of a classic method with some of its parameters.
    #[staticmethod]
    fn classic(
        py: Python<'_>,
        method: &str,
        parameters: Vec<(String, f32)>,
        sides: Sides,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let mut method = Classic::named(method).map_err(errors::of_argument("method"))?;
        for (name, value) in &parameters {
            method.set(name, *value).map_err(errors::value)?;
        }
        let window = window(sides)?;
        let options = search::Options { threads: available(threads)?, ..search::Options::default() };
        let make = || search::Session::new(&method, window, options);
        let session = errors::detached(py, make)?.map_err(errors::value)?;
        Ok(Self::of(Engine::Classic(session), window, true))
    }

    /// Whether the method reads the radius. A network of the paper does not.
    #[getter]
    fn sees_radius(&self) -> bool {
        self.sees_radius
    }

    /// Writes the visibility of a frame's picture to `out`. The result is complete before `out` is written, so `out` may
    /// be an input as well.
    fn run<'py>(
        &self,
        py: Python<'py>,
        camera: &Camera,
        arrays: Arrays<'py>,
        is_world: bool,
        radius: f32,
        out: &Bound<'py, PyArray2<f32>>,
    ) -> PyResult<()> {
        self.check_process()?;
        let radius = AoParams::new(radius).map_err(errors::value)?;
        let broken =
            || PyRuntimeError::new_err("session: expected one that works, found one whose run failed");
        let mut guard = self.state.lock_py_attached(py).map_err(|_| broken())?;
        let state = guard.as_mut().ok_or_else(broken)?;
        let (normal, depth, second) = arrays;
        let layers = Layers {
            normal: elements("normal", &normal)?.as_chunks().0,
            depth: elements("depth", &depth)?,
            second: second.as_ref().map(|second| elements("second", second)).transpose()?,
        };
        let (window, camera) = (self.window, &camera.of_picture);
        let done = errors::detached(py, || state.run(window, camera, (layers, is_world), radius));
        // What a fault leaves behind is not used again.
        done.inspect_err(|_| *guard = None)?.map_err(errors::value)?;
        drop((normal, depth, second));
        guard.as_ref().map_or_else(|| Err(broken()), |state| write(&state.image, out))
    }
}

impl Session {
    fn of(engine: Engine, window: Window, sees_radius: bool) -> Self {
        let state = State { engine, normals: Vec::new(), image: AoImage::open(window.size()) };
        Self { state: Mutex::new(Some(state)), window, sees_radius, process: std::process::id() }
    }

    /// Refuses a fork of the process: a fork has no threads but the one that made it.
    fn check_process(&self) -> PyResult<()> {
        match std::process::id() == self.process {
            true => Ok(()),
            false => Err(PyRuntimeError::new_err(
                "session: expected the process that made it, found a fork of it; make a session in every process",
            )),
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        if std::process::id() != self.process {
            // A fork would wait for threads that it does not have.
            let state = self.state.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
            std::mem::forget(state.take());
        }
    }
}

impl State {
    fn run(
        &mut self,
        window: Window,
        camera: &aonet::Camera,
        (layers, is_world): (Layers<'_>, bool),
        radius: AoParams,
    ) -> aonet::Result<()> {
        let normal = match is_world {
            true => {
                rotate(camera.view_from_world().matrix3, layers.normal, &mut self.normals);
                &self.normals[..]
            }
            false => layers.normal,
        };
        let camera = camera.with_margin(window.margin())?;
        let mut gbuffer = GBuffer::new(camera, layers.depth, normal)?.with_margin(window.margin())?;
        if let Some(depth) = layers.second {
            gbuffer = gbuffer.with_second(SecondLayer { depth: depth.into(), normal: None })?;
        }
        match &mut self.engine {
            Engine::Network(session) => session.run(&gbuffer, radius, &mut self.image),
            Engine::Classic(session) => session.run(&gbuffer, radius, &mut self.image),
        }
    }
}

/// Writes turned vectors; `turned` grows once, to their number.
fn rotate(by: Mat3A, vectors: &[[f32; 3]], turned: &mut Vec<[f32; 3]>) {
    turned.clear();
    turned.extend(vectors.iter().map(|v| (by * Vec3A::from(*v)).to_array()));
}

/// The elements of an array, row by row.
///
/// # Errors
/// When they do not lie side by side in memory.
pub(crate) fn elements<'a, T: Element, D: Dimension>(
    name: &str,
    array: &'a PyReadonlyArray<'_, T, D>,
) -> PyResult<&'a [T]> {
    match array.is_c_contiguous() {
        true => Ok(array.as_slice()?),
        false => Err(errors::wrong(name, "a C-contiguous array", "another one")),
    }
}

/// Copies an image to an array of the same size.
fn write(image: &AoImage, out: &Bound<'_, PyArray2<f32>>) -> PyResult<()> {
    let shape = [image.height(), image.width()];
    if out.shape() != shape || !out.is_c_contiguous() {
        let expected = format!("a C-contiguous array of shape {shape:?}");
        return Err(errors::wrong("out", expected, format!("shape {:?}", out.shape())));
    }
    let mut out = out.try_readwrite().map_err(|e| errors::wrong("out", "an array that can be written", e))?;
    out.as_slice_mut()?.copy_from_slice(image.visibility());
    Ok(())
}

fn shipped_model(name: &Path) -> aonet_scene::Result<Model> {
    let found = shipped::ALL.into_iter().find(|(shipped, _)| name.as_os_str() == *shipped);
    let names = shipped::ALL.map(|(name, _)| name).join(", ");
    let (_, bytes) = found.ok_or_else(|| aonet::Error::value("model", names, name.display()))?;
    Ok(Model::from_bytes(bytes)?)
}

fn model_file(path: &Path) -> aonet_scene::Result<Model> {
    let bytes = std::fs::read(path).map_err(aonet_scene::Error::io(path))?;
    Model::from_bytes(&bytes).map_err(aonet_scene::Error::in_file(path))
}

/// # Errors
/// When there is none of this name, or this machine lacks the instructions for it.
fn precision_named(name: &str) -> PyResult<Precision> {
    let precision = name.parse().map_err(errors::of_argument("precision"))?;
    let all: Vec<_> = Precision::available().collect();
    match all.contains(&precision) {
        true => Ok(precision),
        false => {
            let names: Vec<_> = all.iter().map(Precision::to_string).collect();
            let expected = format!("one that this machine has instructions for ({})", names.join(", "));
            Err(errors::wrong("precision", expected, name))
        }
    }
}

fn window((width, height, x, y): Sides) -> PyResult<Window> {
    let size = Size::named("picture", width, height).map_err(errors::value)?;
    Window::new(size, Margin { x, y }).map_err(errors::value)
}

/// Threads: the given number, by default one for every core that this process may use.
fn available(threads: Option<usize>) -> PyResult<usize> {
    /// More than any machine has use for.
    const MOST: usize = 1024;
    match threads {
        None => Ok(std::thread::available_parallelism().map_or(1, usize::from).min(MOST)),
        Some(threads) if (1..=MOST).contains(&threads) => Ok(threads),
        Some(threads) => Err(errors::wrong("threads", format!("a number in 1..={MOST}"), threads)),
    }
}
