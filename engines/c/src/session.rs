//! What a session of the C interface is.
#![allow(unsafe_code, reason = "a frame is memory of a C program")]

use crate::abi::{Code, Frame};
use crate::arguments::filled;
use crate::failure::{Failure, Result};
use crate::frame::{self, Copies};
use crate::options::{Choice, Method};
use aonet::net::cpu;
use aonet::{AoImage, Window, search};
use std::sync::Mutex;

/// What a program holds a pointer to.
#[derive(Debug)]
pub struct Handle {
    session: Mutex<Session>,
    /// The process that has the threads.
    process: u32,
}

/// A method at one size, and its memory.
#[derive(Debug)]
struct Session {
    engine: Engine,
    window: Window,
    image: AoImage,
    copies: Copies,
}

/// A method that is ready to run.
#[derive(Debug)]
enum Engine {
    Network(Box<cpu::Session>),
    Classic(Box<search::Session>),
}

impl Handle {
    /// # Errors
    /// When there is not enough memory or a thread cannot be started.
    pub(crate) fn new(choice: Choice) -> Result<Self> {
        let Choice { method, window, threads } = choice;
        let engine = match method {
            Method::Network(model, precision) => {
                let options = cpu::Options { threads, precision, ..cpu::Options::default() };
                Engine::Network(Box::new(cpu::Session::with_options(&model, window, options)?))
            }
            Method::Classic(method) => {
                let options = search::Options { threads, ..search::Options::default() };
                Engine::Classic(Box::new(search::Session::new(&method, window, options)?))
            }
        };
        let image = AoImage::new(window.size(), filled("visibility", window.size().pixels(), 1.0)?)?;
        let session = Session { engine, window, image, copies: Copies::default() };
        Ok(Self { session: Mutex::new(session), process: std::process::id() })
    }

    /// Writes the visibility of a frame.
    ///
    /// # Errors
    /// When a field or a pixel is out of its range, or the session cannot run.
    ///
    /// # Safety
    /// Images have the pixels that sizes and strides promise, and matrices have 16 numbers.
    pub(crate) unsafe fn run(&self, frame: &Frame) -> Result<()> {
        let refused = |expected, found| Err(Failure::new(Code::InvalidOperation, "session", expected, found));
        if std::process::id() != self.process {
            return refused("the process that made it", "a fork of it; make a session in every process");
        }
        let Ok(mut session) = self.session.lock() else {
            return refused("one that works", "one whose run ended with AONET_ERROR_INTERNAL");
        };
        // SAFETY: the caller's promise.
        unsafe { session.run(frame) }
    }

    /// Frees a session. In a fork it only forgets it, which would otherwise wait for threads that a fork does not have.
    pub(crate) fn release(self: Box<Self>) {
        if std::process::id() != self.process {
            std::mem::forget(self);
        }
    }
}

impl Session {
    /// # Safety
    /// As [`Handle::run`].
    unsafe fn run(&mut self, frame: &Frame) -> Result<()> {
        // SAFETY: the caller's promise. Visibility, which may lie in an input image, is written when inputs are not
        // used any more.
        let (inputs, output) = unsafe { frame::read(frame, self.window)? };
        let gbuffer = inputs.gbuffer(&mut self.copies)?;
        match &mut self.engine {
            Engine::Network(session) => session.run(&gbuffer, inputs.params, &mut self.image)?,
            Engine::Classic(session) => session.run(&gbuffer, inputs.params, &mut self.image)?,
        }
        drop(gbuffer);
        output.write(&self.image);
        Ok(())
    }
}
