//! The signers of each panel's messages: combines a panel's events with the trusted keys.

use link::signing::Verdict;

use crate::keys::Trust;
use crate::{Message, PANELS_MAX, PanelEvent};

/// What to do with a message after an event of its panel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// Deliver the message, with the verdict on its signer.
    Message(Message, Verdict),
    /// Withhold the message until it is proven.
    Withheld,
    /// Report the verdict on an earlier message, which has these bytes.
    Proof(Vec<u8>, Verdict),
}

/// The trusted keys, and the last message of each panel.
#[derive(Debug, Default)]
pub struct Signers {
    trust: Trust,
    only_trusted: bool,
    /// The last message; with `only_trusted`, until it is proven.
    latest: [Option<Message>; PANELS_MAX],
}

impl Signers {
    /// With `only_trusted`, messages are withheld until they are proven.
    pub fn new(trust: Trust, only_trusted: bool) -> Self {
        Self {
            trust,
            only_trusted,
            ..Self::default()
        }
    }

    /// The trusted keys.
    pub fn trust(&self) -> &Trust {
        &self.trust
    }

    /// The trusted keys, to take the counters after a proof.
    pub fn trust_mut(&mut self) -> &mut Trust {
        &mut self.trust
    }

    /// The delivery after an event of a panel, if the event is about a message or its signer.
    pub fn delivery(&mut self, panel: usize, event: &PanelEvent) -> Option<Delivery> {
        let latest = self.latest.get_mut(panel)?;
        let (data, verdict) = match event {
            PanelEvent::Message(message) => {
                *latest = Some(message.clone());
                return Some(match self.only_trusted {
                    true => Delivery::Withheld,
                    false => Delivery::Message(message.clone(), Verdict::Unproven),
                });
            }
            PanelEvent::Signed(signed) => (signed.data.clone(), self.trust.verdict(signed)),
            PanelEvent::Unsigned => (latest.as_ref()?.data.clone(), Verdict::Unsigned),
            _ => return None,
        };
        let is_delivered = self.only_trusted && matches!(verdict, Verdict::Proven { .. });
        let message = latest.take_if(|latest| is_delivered && latest.data == data);
        Some(match message {
            Some(message) => Delivery::Message(message, verdict),
            // Also a message that was delivered before and is signed again.
            None => Delivery::Proof(data, verdict),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SignedMessage;
    use crate::keys::NamedKey;
    use link::signing::SecretKey;

    fn message() -> PanelEvent {
        PanelEvent::Message(Message {
            data: b"ice".to_vec(),
            first_frame: 3,
            last_frame: 9,
            corrected_bits: 0,
        })
    }

    fn signed(key: &SecretKey, counter: u32) -> PanelEvent {
        PanelEvent::Signed(SignedMessage {
            data: b"ice".to_vec(),
            signature: key.sign(b"ice", counter),
        })
    }

    /// The names of the verdicts on each event, in capitals if the message is delivered with it.
    fn verdicts(signers: &mut Signers, events: &[PanelEvent]) -> Vec<String> {
        let names = events.iter().map(|event| match signers.delivery(0, event) {
            Some(Delivery::Message(_, verdict)) => verdict.name().to_uppercase(),
            Some(Delivery::Proof(_, verdict)) => verdict.name().into(),
            Some(Delivery::Withheld) => "withheld".into(),
            None => "nothing".into(),
        });
        names.collect()
    }

    fn trust(key: &SecretKey) -> Trust {
        let (name, key) = ("truck 12".into(), key.public());
        let text = NamedKey { name, key }.to_toml().unwrap();
        Trust::parse(&text, "the test").unwrap()
    }

    #[test]
    fn messages_and_their_signers_are_told() {
        let [own, other] = [1, 2].map(|seed| SecretKey::from_seed([seed; 32]).unwrap());
        let events = [
            PanelEvent::Unsigned,
            message(),
            signed(&own, 7),
            signed(&own, 7),
            signed(&other, 1),
            PanelEvent::Unsigned,
        ];
        let mut signers = Signers::new(trust(&own), false);
        assert_eq!(
            verdicts(&mut signers, &events),
            ["nothing", "UNPROVEN", "proven", "replayed", "unknown", "unsigned"]
        );
        assert_eq!(signers.delivery(1, &PanelEvent::Unsigned), None);
        let mut signers = Signers::new(trust(&own), true);
        assert_eq!(
            verdicts(&mut signers, &events),
            ["nothing", "withheld", "PROVEN", "replayed", "unknown", "nothing"]
        );
        // Without keys, a signature is never proven.
        let mut signers = Signers::default();
        assert_eq!(
            verdicts(&mut signers, &events),
            ["nothing", "UNPROVEN", "unchecked", "unchecked", "unchecked", "unsigned"]
        );
    }

    #[test]
    fn a_verdict_names_the_owner_of_a_trusted_key_alone() {
        let [own, other] = [1, 2].map(|seed| SecretKey::from_seed([seed; 32]).unwrap());
        let mut signers = Signers::new(trust(&own), false);
        let mut text = |event| match signers.delivery(0, &event) {
            Some(Delivery::Proof(_, verdict)) => signers.trust().text(&verdict),
            delivery => panic!("{delivery:?}"),
        };
        let id = own.public().id();
        assert_eq!(text(signed(&own, 7)), format!("proven: signed by truck 12 ({id}), counter 7"));
        assert!(!text(signed(&other, 7)).contains("truck"));
    }
}
