//! The network as a value: [`config`] builds a [`graph`], backends interpret it.
