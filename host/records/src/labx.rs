//! CASSY Lab, Leybold's XML (.labx): each channel with its quantity, its unit and its values.

use super::table::Channel;
use quick_xml::events::Event;
use quick_xml::Reader;

/// The root element.
const ROOT: &[u8] = b"<cassylab";
/// A root stands in so many bytes.
pub(super) const HEAD: usize = 512;

pub(super) fn is_one(head: &[u8]) -> bool {
    let head = &head[..head.len().min(HEAD)];
    head.windows(ROOT.len()).any(|at| at == ROOT)
}

/// A channel as it is read.
#[derive(Default)]
struct Open {
    quantity: String,
    symbol: String,
    unit: String,
    values: Vec<f64>,
    wrong: Option<String>,
}

impl Open {
    fn push(&mut self, text: &str) {
        match text.trim().replace(',', ".").parse() {
            Ok(value) => self.values.push(value),
            Err(_) if text.trim().is_empty() => self.values.push(f64::NAN),
            Err(_) => self.wrong = Some(format!("{text:?} is not a number")),
        }
    }

    /// As channel of run `run`; none without numbers.
    fn channel(self, run: usize) -> Option<Channel> {
        if self.wrong.is_none() && !self.values.iter().any(|value| value.is_finite()) {
            return None;
        }
        let name = if self.quantity.is_empty() { self.symbol } else { self.quantity };
        let name = if run > 1 { format!("run {run}/{name}") } else { name };
        let unit = Some(self.unit).filter(|unit| !unit.is_empty());
        let values = self.wrong.map_or(Ok(self.values), Err);
        Some(Channel { name, unit, step_s: None, values })
    }
}

pub(super) fn of_text(text: &str) -> Result<Vec<Channel>, String> {
    let mut reader = Reader::from_str(text);
    let mut channels = Vec::new();
    let mut open: Option<Open> = None;
    let (mut inside, mut run, mut depth) = (String::new(), 0, 0usize);
    loop {
        let at = reader.buffer_position();
        match reader.read_event().map_err(|e| format!("at byte {at}: {e}"))? {
            Event::Start(element) => {
                depth += 1;
                inside = element.name().as_ref().to_owned();
                match inside.as_str() {
                    // Its channels are repeats of one quantity.
                    "channels" => run = 0,
                    "channel" => {
                        run += 1;
                        open = Some(Open::default());
                    }
                    _ => {}
                }
            }
            Event::Empty(element) if element.name().as_ref() == "value" => {
                if let Some(open) = &mut open {
                    open.push("");
                }
            }
            Event::Text(text) => {
                let Some(open) = &mut open else { continue };
                let text = text.trim().to_owned();
                match inside.as_str() {
                    "quantity" => open.quantity = text,
                    "symbol" => open.symbol = text,
                    "unit" => open.unit = text,
                    "value" => open.push(&text),
                    _ => {}
                }
            }
            Event::End(element) => {
                inside.clear();
                depth = depth.saturating_sub(1);
                if element.name().as_ref() == "channel" {
                    channels.extend(open.take().and_then(|open| open.channel(run)));
                }
            }
            Event::Eof if depth > 0 => {
                return Err("it ends within an element: it was cut".to_owned())
            }
            Event::Eof => break,
            _ => {}
        }
    }
    match channels.is_empty() {
        true => Err("there is no channel of numbers in it".to_owned()),
        false => Ok(channels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_channel_has_its_unit_and_its_numbers() {
        let channel = |quantity: &str, unit: &str, values: &str| {
            format!("<channel dec=\"2\"><quantity>{quantity}</quantity><symbol>x</symbol>{unit}<range min=\"0\" /><values count=\"3\">{values}</values></channel>")
        };
        let text = format!(
            "<?xml version=\"1.0\" encoding=\"utf-8\"?><cassylab xml:lang=\"de-DE\"><ios><io><quantities><quantity rangemax=\"1\" /></quantities></io></ios><allchannels><channels>{}</channels><channels>{}{}</channels></allchannels></cassylab>",
            channel("Zeit", "<unit>s</unit>", "<value>0</value><value>0.1</value><value>0.2</value>"),
            channel("Winkel", "<unit>°</unit>", "<value>1.5</value><value>NaN</value><value />"),
            channel("", "<unit />", "<value>a</value>"),
        );
        assert!(is_one(text.as_bytes()));
        let channels = of_text(&text).expect("channels");
        let said: Vec<(&str, Option<&str>)> =
            channels.iter().map(|c| (c.name.as_str(), c.unit.as_deref())).collect();
        assert_eq!(said, [("Zeit", Some("s")), ("Winkel", Some("°")), ("run 2/x", None)]);
        assert_eq!(channels[0].values, Ok(vec![0.0, 0.1, 0.2]));
        let angle = channels[1].values.clone().expect("numbers");
        assert!(angle[0] == 1.5 && angle.len() == 3 && angle[1].is_nan() && angle[2].is_nan());
        assert_eq!(channels[2].values, Err("\"a\" is not a number".to_owned()));
        // Cut after a whole channel, too.
        for end in [text.len() / 2, text.rfind("</allchannels>").expect("its end")] {
            let cut = of_text(text.get(..end).expect("between two letters"));
            assert!(cut.is_err_and(|why| why.contains("cut") || why.contains("byte")), "{end}");
        }
    }
}
