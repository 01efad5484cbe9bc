//! Channels in a file are their names, so that a layout outlives a table that has grown; names that are gone are
//! dropped.

use crate::channel::Id;
use serde::{Deserialize, Deserializer, Serializer};

pub(super) fn serialize<S: Serializer>(channels: &[Id], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(channels.iter().map(|channel| channel.channel().name))
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Id>, D::Error> {
    let names = Vec::<String>::deserialize(deserializer)?;
    Ok(names.iter().filter_map(|name| Id::from_name(name)).collect())
}
