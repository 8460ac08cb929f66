//! What a live view offers: the recording's own topics, and two that are made for it.

use biplane_recording::Topic;
use biplane_recording::messages::schema;

/// Topics of the recording that are shown, in the order of their channels.
const TOPICS: [Topic; 8] = [
    Topic::ScanHorizontal,
    Topic::ScanVertical,
    Topic::Odom,
    Topic::Pose,
    Topic::PoseVertical,
    Topic::Tf,
    Topic::TfStatic,
    Topic::Diagnostics,
];

/// A channel's number in the protocol, from 1.
#[derive(Copy, Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct ChannelId(pub u32);

/// The floor map so far.
pub(crate) const MAP: ChannelId = ChannelId(TOPICS.len() as u32 + 1);
/// The points of the vertical laser so far, in increments.
pub(crate) const POINTS: ChannelId = ChannelId(TOPICS.len() as u32 + 2);

/// A stream that a viewer can subscribe to; CDR, described as `ros2msg`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Channel {
    /// Its number.
    pub id: ChannelId,
    /// Its topic, for example `/scan/horizontal`.
    pub topic: &'static str,
    /// Its message type, for example `sensor_msgs/msg/LaserScan`.
    pub type_name: &'static str,
    /// The text that describes the type.
    pub schema: String,
}

impl ChannelId {
    /// The channel of a topic of the recording; nothing for one that is not shown.
    pub(crate) fn of(topic: Topic) -> Option<Self> {
        let place = TOPICS.iter().position(|&shown| shown == topic)?;
        Some(Self(place as u32 + 1))
    }

    /// Whether there is such a channel.
    pub(crate) fn exists(self) -> bool {
        (1..=POINTS.0).contains(&self.0)
    }
}

/// All channels.
pub(crate) fn channels() -> Vec<Channel> {
    let recorded = TOPICS.into_iter().map(|topic| (topic.name(), topic.type_name()));
    let made = [("/map", "nav_msgs/msg/OccupancyGrid"), ("/points", "sensor_msgs/msg/PointCloud2")];
    let channel = |(id, (topic, type_name)): (u32, (&'static str, &'static str))| Channel {
        id: ChannelId(id),
        topic,
        type_name,
        schema: schema::ros2msg(type_name).unwrap_or_default(),
    };
    (1..).zip(recorded.chain(made)).map(channel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_has_a_number_of_its_own_and_a_schema() {
        let channels = channels();
        for (channel, id) in channels.iter().zip(1..) {
            assert_eq!(channel.id, ChannelId(id));
            assert!(channel.id.exists() && !channel.schema.is_empty(), "{channel:?}");
        }
        let topic = |id: ChannelId| channels[id.0 as usize - 1].topic;
        assert_eq!((topic(MAP), topic(POINTS)), ("/map", "/points"));
        for shown in TOPICS {
            assert_eq!(topic(ChannelId::of(shown).unwrap()), shown.name());
        }
        assert_eq!(ChannelId::of(Topic::PoseIncremental), None);
        assert!(!ChannelId(0).exists() && !ChannelId(11).exists());
    }

    /// Keys and texts that name a topic, without the path into its messages.
    fn topics(value: &serde_json::Value, found: &mut Vec<String>) {
        let mut note = |text: &str| {
            if text.starts_with('/') {
                found.extend(text.split('.').next().map(str::to_owned));
            }
        };
        match value {
            serde_json::Value::String(text) => note(text),
            serde_json::Value::Array(values) => values.iter().for_each(|value| topics(value, found)),
            serde_json::Value::Object(fields) => {
                fields.keys().for_each(|key| note(key));
                fields.values().for_each(|value| topics(value, found));
            }
            _ => {}
        }
    }

    #[test]
    fn the_layout_names_topics_that_are_served_and_the_page_tells_of_all() {
        let layout = serde_json::from_str(include_str!("../../../../../docs/live-layout.json")).unwrap();
        let mut named = Vec::new();
        topics(&layout, &mut named);
        for topic in &named {
            assert!(channels().iter().any(|channel| channel.topic == topic), "{topic} is not served");
        }
        let page = include_str!("../../../../../docs/live.md");
        for Channel { topic, type_name, .. } in channels() {
            // Transforms are shown by frame, not by topic.
            assert!(
                named.iter().any(|other| other == topic) || topic.starts_with("/tf"),
                "the layout lacks {topic}"
            );
            assert!(page.contains(&format!("`{topic}`")), "docs/live.md does not tell of {topic}");
            assert!(!["/map", "/points"].contains(&topic) || page.contains(type_name), "{type_name}");
        }
    }
}
