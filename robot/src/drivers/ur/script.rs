//! The text that runs on the controller, and what is written into it.

use nalgebra::Vector3;

/// The text, with its numbers in braces.
const TEXT: &str = include_str!("probepath.script");

/// How a text begins that is ours: a simulated controller knows it by this line.
pub const FIRST_LINE: &str = "def probepath():";

/// What the driver writes into the text before it sends it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Ticks without a new sequence number until the script stops the arm.
    pub watchdog_ticks: u32,
    /// The controller's own net: how often a second the sequence number is written at least.
    pub watchdog_hz: f64,
    /// servoj's lookahead (s), 0.03 to 0.2.
    pub lookahead_s: f64,
    /// servoj's gain, 100 to 2000.
    pub gain: f64,
    /// What the flange carries (kg).
    pub mass_kg: f64,
    /// Its centre of gravity from the flange, in the flange's axes (m).
    pub centre_of_gravity_m: Vector3<f64>,
}

impl Parameters {
    /// The text to send; it ends with a line's end, without which a controller would not begin it.
    pub fn text(&self) -> String {
        let numbers = self.numbers().map(|(name, value)| (format!("{{{name}}}"), format!("{value:?}")));
        let filled = numbers.iter().fold(TEXT.to_owned(), |text, (name, value)| text.replace(name, value));
        filled.replace("{WATCHDOG_TICKS}", &self.watchdog_ticks.to_string())
    }

    fn numbers(&self) -> [(&'static str, f64); 7] {
        let centre = self.centre_of_gravity_m;
        [
            ("WATCHDOG_HZ", self.watchdog_hz),
            ("LOOKAHEAD_S", self.lookahead_s),
            ("GAIN", self.gain),
            ("MASS_KG", self.mass_kg),
            ("COG_X_M", centre.x),
            ("COG_Y_M", centre.y),
            ("COG_Z_M", centre.z),
        ]
    }

    /// What was written into a text that somebody sends; `None` when it is not ours, or not whole. For whoever stands
    /// in for the controller.
    pub fn read(text: &str) -> Option<Self> {
        text.trim_start().strip_prefix(FIRST_LINE)?;
        let number = |before: &str, after: &str| value(text, before, after)?.parse::<f64>().ok();
        let ticks = value(text, "global pp_limit = ", "\n")?.parse().ok()?;
        let (mass, centre) = value(text, "set_payload(", ")")?.split_once(',')?;
        let mut centre = centre.trim().strip_prefix('[')?.strip_suffix(']')?.split(',');
        let mut next = || centre.next()?.trim().parse::<f64>().ok();
        let read = Self {
            watchdog_ticks: ticks,
            watchdog_hz: number("rtde_set_watchdog(\"input_int_register_24\", ", ",")?,
            lookahead_s: number("global pp_lookahead = ", "\n")?,
            gain: number("global pp_gain = ", "\n")?,
            mass_kg: mass.trim().parse().ok()?,
            centre_of_gravity_m: Vector3::new(next()?, next()?, next()?),
        };
        read.numbers().iter().all(|(_, value)| value.is_finite()).then_some(read)
    }
}

/// What stands between `before` and `after` on the first line that is no comment and has `before`.
fn value<'a>(text: &'a str, before: &str, after: &str) -> Option<&'a str> {
    let lines = text.split_inclusive('\n').filter(|line| !line.trim_start().starts_with('#'));
    let rest = lines.filter_map(|line| line.split_once(before)).map(|(_, rest)| rest).next()?;
    rest.split_once(after).map(|(value, _)| value.trim())
}

#[cfg(test)]
mod tests {
    use super::super::registers::{self, command, state};
    use super::*;

    const SOME: Parameters = Parameters {
        watchdog_ticks: 20,
        watchdog_hz: 10.0,
        lookahead_s: 0.03,
        gain: 300.0,
        mass_kg: 0.75,
        centre_of_gravity_m: Vector3::new(0.001, -2e-9, 0.08),
    };

    #[test]
    fn what_is_written_into_the_text_is_read_from_it() {
        assert_eq!(Parameters::read(&SOME.text()), Some(SOME));
    }

    #[test]
    fn the_text_is_ours_whole_and_without_braces_left() {
        let text = SOME.text();
        assert!(text.starts_with(FIRST_LINE) && text.ends_with("\nend\n"));
        assert!(!text.contains(['{', '}', '\t', '\r']) && text.is_ascii());
        assert!(text.contains("set_payload(0.75, [0.001, -2e-9, 0.08])"), "numbers as URScript reads them");
    }

    /// `def`, `thread`, `while` and `if` each have their `end`: URScript has no other blocks here.
    #[test]
    fn every_block_ends_at_its_own_depth() {
        let mut open: Vec<usize> = Vec::new();
        for (number, line) in TEXT.lines().enumerate() {
            let (indent, line) = (line.len() - line.trim_start().len(), line.trim());
            let word = line.split([' ', ':', '(']).next().unwrap();
            match word {
                "def" | "thread" | "while" | "if" => {
                    assert!(line.ends_with(':'), "line {}", number + 1);
                    open.push(indent);
                }
                "elif" | "else" => assert_eq!(open.last(), Some(&indent), "line {}", number + 1),
                "end" => assert_eq!(open.pop(), Some(indent), "line {}", number + 1),
                "" => {}
                _ => assert_eq!(indent, 2 * open.len(), "line {}", number + 1),
            }
        }
        assert!(open.is_empty(), "{open:?}");
    }

    #[test]
    fn the_text_and_the_map_of_registers_say_the_same() {
        let has = |line: String| assert!(TEXT.contains(&line), "{line}");
        has(format!("global PP_PROTOCOL = {}\n", registers::PROTOCOL));
        for (name, number) in [
            ("STAY", command::STAY),
            ("HELLO", command::HELLO),
            ("SERVO", command::SERVO),
            ("FREEDRIVE", command::FREEDRIVE),
            ("ZERO", command::ZERO),
            ("END", command::END),
        ] {
            has(format!("global PP_{name} = {number}\n"));
        }
        has(format!("read_input_integer_register({}) == seq", registers::IN_SEQUENCE));
        has(format!("command = read_input_integer_register({})", registers::IN_COMMAND));
        has(format!("session = read_input_integer_register({})", registers::IN_SESSION));
        let joints: Vec<String> =
            (0..6).map(|i| format!("read_input_float_register({})", registers::IN_SETPOINT + i)).collect();
        has(format!("pp_q = [{}]", joints.join(", ")));
        has(format!("write_output_integer_register({}, PP_PROTOCOL)", registers::OUT_PROTOCOL));
        has(format!("write_output_integer_register({}, seq)", registers::OUT_SEQUENCE));
        has(format!("write_output_integer_register({}, session)", registers::OUT_SESSION));
        has(format!("write_output_integer_register({}, pp_doing)", registers::OUT_STATE));
        has(format!("write_output_integer_register({}, pp_zeroed)", registers::OUT_ZEROED));
        has(format!("pp_doing = {}\n          servoj", state::SERVOING));
        has(format!("feature=p[0, 0, 0, 0, 0, 0])\n          pp_doing = {}", state::FREEDRIVE));
        has(format!("pp_bad = {}\n    end\n\n    # A handshake", state::TIMED_OUT));
        has(format!("else:\n          pp_bad = {}", state::REFUSED));
        has(format!(
            "kill mover\n      write_output_integer_register({}, {})",
            registers::OUT_STATE,
            state::HUNG
        ));
    }

    #[test]
    fn what_is_not_ours_or_not_whole_reads_as_nothing() {
        let text = SOME.text();
        assert_eq!(Parameters::read("def rtde_control():\nend\n"), None);
        assert_eq!(Parameters::read(""), None);
        let needed = text.find("rtde_set_watchdog(\"input").unwrap() + 45;
        for cut in (0..needed).filter(|cut| text.is_char_boundary(*cut)) {
            assert_eq!(Parameters::read(&text[..cut]), None, "cut at {cut}");
        }
        assert_eq!(Parameters::read(&text.replace("0.75", "heavy")), None);
        assert_eq!(Parameters::read(&text.replace("0.75", "inf")), None);
    }
}
