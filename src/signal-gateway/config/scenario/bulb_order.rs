//! The order of the bulbs of lights, for states in ASAM's notation: `on;off;off`.

use std::str::FromStr;

use traffic_lights::bulb::Bulb;
use traffic_lights::signal_id::parse_id;
use traffic_lights::text::parse_bulb;

/// The bulbs by position, for some lights or for all lights with as many positions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BulbOrder {
    /// Ids of the lights; empty for all other lights.
    ids: Vec<i64>,
    bulbs: Vec<Bulb>,
}

impl BulbOrder {
    /// Returns the bulbs of a light with this number of positions: the order for its id, otherwise the order
    /// for all lights.
    pub(super) fn find(orders: &[Self], id: i64, positions: usize) -> Option<&[Bulb]> {
        let fitting = || orders.iter().filter(|order| order.bulbs.len() == positions);
        let own = fitting().find(|order| order.ids.contains(&id));
        own.or_else(|| fitting().find(|order| order.ids.is_empty())).map(|order| order.bulbs.as_slice())
    }
}

/// Reads `red,yellow,green`, or `101,102=red,green left` for some lights.
impl FromStr for BulbOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (ids, bulbs) = text.split_once('=').unwrap_or(("", text));
        let ids = ids.split_terminator(',').map(|id| parse_id(id.trim()).map_err(|error| error.to_string()));
        let bulbs = bulbs.split(',').map(|bulb| match bulb.trim() {
            "" => Err("a bulb is missing".to_owned()),
            bulb => parse_bulb(bulb).map_err(|error| error.to_string()),
        });
        Ok(Self { ids: ids.collect::<Result<_, _>>()?, bulbs: bulbs.collect::<Result<_, _>>()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_for_a_light_counts_before_one_for_all() {
        let orders = ["red,yellow,green", "red,green", "7,8=green,red", "9=green"];
        let orders: Vec<BulbOrder> = orders.iter().map(|order| order.parse().unwrap()).collect();
        let colors = |id, positions| {
            let bulbs = BulbOrder::find(&orders, id, positions)?;
            Some(bulbs.iter().map(|bulb| bulb.color.name()).collect::<Vec<_>>().join(" "))
        };
        assert_eq!(colors(1, 3).as_deref(), Some("red yellow green"));
        assert_eq!(colors(1, 2).as_deref(), Some("red green"));
        assert_eq!(colors(8, 2).as_deref(), Some("green red"));
        assert_eq!(colors(8, 3).as_deref(), Some("red yellow green"));
        assert_eq!((colors(9, 1).as_deref(), colors(1, 1)), (Some("green"), None));
    }

    #[test]
    fn what_is_not_an_order_is_refused() {
        for text in ["", "red,", "red,,green", "rot", "x=red", "1,=red,", "1=2=red"] {
            assert!(text.parse::<BulbOrder>().is_err(), "{text}");
        }
    }
}
