//! What a mock laser measures and sends.

pub mod feed;
pub mod mean;
pub mod remission;
pub mod stream;
pub mod telegram;
pub mod value_words;
