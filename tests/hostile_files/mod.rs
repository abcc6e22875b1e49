//! Makes hostile files. Nothing here is of the gateway: what it reads is written by others.

#![allow(dead_code)] // each program needs a part of it

pub(crate) mod case;
pub(crate) mod choices;
pub(crate) mod damage;
pub(crate) mod named;
pub(crate) mod named_lines;
pub(crate) mod named_mcap;
pub(crate) mod named_mf4;
pub(crate) mod named_objects;
pub(crate) mod named_sqlite;
pub(crate) mod named_texts;
pub(crate) mod nested_texts;
pub(crate) mod nests;
pub(crate) mod packing;
pub(crate) mod recordings;
pub(crate) mod sqlite;
