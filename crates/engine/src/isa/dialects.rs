//! Mnemonics of other controllers, and the instructions or contacts of a rungd ladder for each.
//!
//! Read by `resolve` for the help of an unknown instruction, and by `rungd explain`. None of the
//! mnemonics here is an instruction of rungd's table.

use super::Space;

/// Mnemonics with the same meaning, and the text to write instead.
type Dialect = (&'static [&'static str], &'static str);

const ROWS: &[Dialect] = &[
    (&["XIC", "LD", "STR"], "a normally open contact is the bit's name: `when = [\"X0\"]`"),
    (
        &["XIO", "LDI", "LDN", "STRN", "ANI", "ANDN"],
        "a normally closed contact is `!`: `when = [\"!X0\"]`",
    ),
    (
        &["AND", "ANB", "ANDSTR"],
        "contacts in series are the elements of an array: `when = [\"X0\", \"X1\"]`",
    ),
    (
        &["OR", "ORB", "ORSTR", "BST", "NXB", "BND"],
        "a parallel branch is `|`: `when = [\"X0 | X1\"]`",
    ),
    (
        &["OSR", "ONS", "OSRI", "R_TRIG", "PLS", "DIFU", "STRPD", "LDP"],
        "a rising edge is the contact `rise(b)`; a bit for one scan is `PD b`",
    ),
    (
        &["OSF", "OSFI", "F_TRIG", "PLF", "DIFD", "STRND", "LDF"],
        "a falling edge is the contact `fall(b)`; a bit for one scan is `ND b`",
    ),
    (&["OTE", "OUTPUT", "COIL", "ST", "="], "an output coil is `OUT b`"),
    (&["OTL", "LATCH", "S"], "a latch is `SET b`"),
    (&["OTU", "UNLATCH", "RESET", "R"], "an unlatch is `RST b`"),
    (&["KEEP", "RS"], "a latch is `SET b` in one rung and `RST b` in another"),
    (
        &["TON", "TIM", "TMRF", "DELAY"],
        "an on-delay is `TMR t preset=d`, or `ONDTMR t preset=d output=b`",
    ),
    (&["TOF"], "an off-delay is `OFFDTMR t preset=d output=b`"),
    (
        &["TP"],
        "a pulse of a fixed length is the template `Pulse` of `lib:pulse`; a bit for one scan is \
         `PD b`",
    ),
    (
        &["RTO", "TONR", "TMRAF"],
        "a retentive timer is `TMRA t preset=d`, or `TMRAG` to survive a stop",
    ),
    (&["CTUD", "UDCNT", "UDCTR"], "an up/down counter is `UDC ct up-preset=n`"),
    (&["CTR", "COUNTER"], "an up counter is `CNT ct preset=n`"),
    (&["MOV", "MOVD", "MVM", "LDD", "OUTD"], "write `MOVE v to=w`"),
    (
        &["COP", "BMOV", "BLKMOV", "MEMCOPY"],
        "write `COPY D10..D16 to=D20..D26`, or name arrays: `COPY recipe to=active`",
    ),
    (
        &["MUL", "MULD", "MULB", "MULR", "DIV", "DIVD", "DIVB", "DIVR", "MOD", "CPT", "CALC"],
        "write `MATH D0 = D1 * D2 / 100`",
    ),
    (&["ADDD", "ADDB", "ADDR"], "a sum is `ADD v v to=w`, or `MATH D0 = D1 + D2`"),
    (&["SUBD", "SUBB", "SUBR"], "a difference is `SUB v v to=w`, or `MATH D0 = D1 - D2`"),
    (&["INC", "INCB"], "write `ADD D0 1 to=D0` in a rung with an edge: `when = [\"rise(X0)\"]`"),
    (&["DEC", "DECB"], "write `SUB D0 1 to=D0` in a rung with an edge: `when = [\"rise(X0)\"]`"),
    (&["NEG"], "write `MATH D0 = -D1`"),
    (&["SQR", "SQRTR"], "write `MATH R0 = sqrt(R1)`"),
    (&["SCL", "SCP", "SCLP"], "write `MATH R0 = scale(D0, 6400, 32000, 0.0, 100.0)`"),
    (&["XOR", "XORD", "WAND", "WOR", "WXR"], "write `MATH D0 = D1 ^ D2`; `&` and `|` work too"),
    (
        &["BTD", "BTDT"],
        "bits go into a word by `PACK C0..C7 to=D0`, out of one by `UNPACK D0 to=C0..C7`; a \
         single bit is `OUT D1.3`",
    ),
    (&["FLL", "MEMSET"], "write `FILL v to=a`: `FILL 0 to=D10..D16`"),
    (
        &["SHFT", "SHFR", "SFL", "SFR", "BSL", "BSR", "SHL", "SHR"],
        "a shift register is `SR C0..C7`, with the legs data, clk and rst; bits of a word shift in \
         `MATH D0 = D0 << 1`",
    ),
    (
        &["DRUM", "EDRUM", "DRM", "SQO", "SQI", "SQL"],
        "a drum is the template `Sequence` of `lib:sequence`, or a Program with a Stage for each \
         step: `OUT b` in its rungs, `JMP s` to the next",
    ),
    (&["EQU", "EQ", "CMP"], "a comparison is a contact: `when = [\"D0 == 5\"]`"),
    (&["NEQ", "NE"], "a comparison is a contact: `when = [\"D0 != 5\"]`"),
    (&["GRT", "GT"], "a comparison is a contact: `when = [\"D0 > 5\"]`"),
    (&["GEQ", "GE"], "a comparison is a contact: `when = [\"D0 >= 5\"]`"),
    (&["LES", "LT"], "a comparison is a contact: `when = [\"D0 < 5\"]`"),
    (&["LEQ", "LE"], "a comparison is a contact: `when = [\"D0 <= 5\"]`"),
    (&["LIM"], "limits are two contacts: `when = [\"D0 >= 5\", \"D0 <= 9\"]`"),
    (&["JSR", "GTS"], "a subroutine is executed by `CALL s`"),
    (&["START"], "a program is started by `RUN p`, a task by `ENTASK t`"),
    (
        &["SBR", "SUBROUTINE", "FUNCTION", "FB"],
        "a subroutine is `[[subroutine]]`, executed by `CALL s`",
    ),
    (
        &["FOR", "NEXT", "WHILE", "WEND", "REPEAT", "UNTIL", "LOOP"],
        "a rung executes once a scan and never loops: a Stage repeats its rungs until `JMP s`; \
         whole arrays are taken by `sum(a)`, COPY and FILL",
    ),
    (&["GOTO"], "a stage is left by `JMP s`"),
    (&["LBL", "SG", "ISG"], "a stage is `[[program.stage]]`; `JMP s` goes to it"),
    (&["CV", "CVJMP"], "stages converge by `SGCONVRG s s to=s`"),
    (
        &["MCR", "MLS", "MLR"],
        "put rungs that are skipped together into a Stage or a Program of their own",
    ),
    (&["RET", "RT"], "a subroutine is left by `RETURN`; a program ends itself by `EXIT`"),
    (&["END", "TND"], "a program ends itself by `EXIT`"),
    (&["SUS", "HLT"], "the controller is stopped by `STOP`"),
    (&["NOP"], "leave out a rung that does nothing"),
    (&["OUTI", "STRI", "IIM", "IOM"], "inputs are read before each scan, outputs written after it"),
    (&["AFI"], "a rung that is never ON has the contact `$Off`"),
];

/// Whether a ladder needs nothing in the place of an instruction of another controller.
pub fn is_superfluous(name: &str) -> bool {
    let name = name.to_ascii_uppercase();
    matches!(name.as_str(), "NOP" | "END" | "TND" | "OUTI" | "STRI" | "IIM" | "IOM")
}

/// The contact of a rungd ladder for a contact of another controller, with its own operands:
/// `XIO`, `["b"]` is `!b`. `None` if it is no contact, or has a different number of operands.
pub fn contact(name: &str, operands: &[&str]) -> Option<String> {
    let name = name.to_ascii_uppercase();
    let sign = match name.as_str() {
        "EQU" | "EQ" | "CMP" => "==",
        "NEQ" | "NE" => "!=",
        "GRT" | "GT" => ">",
        "GEQ" | "GE" => ">=",
        "LES" | "LT" => "<",
        "LEQ" | "LE" => "<=",
        _ => "",
    };
    match (name.as_str(), operands) {
        ("XIC" | "LD" | "STR" | "AND" | "A" | "U" | "OR" | "O", [bit]) => Some((*bit).to_owned()),
        ("XIO" | "LDI" | "LDN" | "STRN" | "ANI" | "ANDN" | "AN" | "UN" | "ORN" | "ON", [bit]) => {
            Some(format!("!{bit}"))
        }
        ("OSR" | "ONS" | "OSRI" | "R_TRIG" | "PLS" | "DIFU" | "STRPD" | "LDP" | "FP", [bit]) => {
            Some(format!("rise({bit})"))
        }
        ("OSF" | "OSFI" | "F_TRIG" | "PLF" | "DIFD" | "STRND" | "LDF" | "FN", [bit]) => {
            Some(format!("fall({bit})"))
        }
        ("LIM", [low, value, high]) => Some(format!("{value} >= {low} & {value} <= {high}")),
        (_, [a, b]) if !sign.is_empty() => Some(format!("{a} {sign} {b}")),
        _ => None,
    }
}

/// Whether a contact of another controller is in parallel to the contacts before it.
pub fn is_parallel(name: &str) -> bool {
    ["OR", "O", "ORN", "ON"].iter().any(|other| other.eq_ignore_ascii_case(name))
}

/// The instruction of a rungd ladder for one of another controller, with its own operands: `JSR`,
/// `["Fill", "0"]` is `CALL Fill`. `None` if it needs more than they say.
pub fn instruction(name: &str, operands: &[&str]) -> Option<String> {
    let name = name.to_ascii_uppercase();
    Some(match (name.as_str(), operands) {
        ("OTE" | "OUTPUT" | "COIL" | "ST" | "=", [bit]) => format!("OUT {bit}"),
        ("OTL" | "LATCH" | "S", [bit]) => format!("SET {bit}"),
        ("OTU" | "UNLATCH" | "RESET" | "R", [bit]) => format!("RST {bit}"),
        ("JSR" | "GTS", [block, ..]) if block.starts_with(|c: char| c.is_ascii_alphabetic()) => {
            format!("CALL {block}")
        }
        ("RET" | "RT", _) => "RETURN".to_owned(),
        ("COP" | "BMOV" | "BLKMOV", [from, to, count]) => {
            format!("COPY {} to={}", elements(from, count)?, elements(to, count)?)
        }
        ("FLL", [value, to, count]) => format!("FILL {value} to={}", elements(to, count)?),
        ("BTD", [from, from_bit, to, to_bit, count]) => {
            let [from_bit, to_bit, count] = [from_bit, to_bit, count].map(|n| n.parse().ok());
            let source = BitField { word: from, first: from_bit? };
            distributed(&source, &BitField { word: to, first: to_bit? }, count?)?
        }
        _ => return None,
    })
}

/// Some bits of a word, from a first one on.
struct BitField<'w> {
    word: &'w str,
    first: u32,
}

/// The MATH that writes bits of a word into another one, and leaves its other bits.
fn distributed(from: &BitField, to: &BitField, count: u32) -> Option<String> {
    let is_within = |field: &BitField| field.first.checked_add(count).is_some_and(|end| end <= 32);
    if count == 0 || count == 32 || !is_within(from) || !is_within(to) {
        return None;
    }
    let (source, target) = (from.word, to.word);
    if count == 1 {
        return Some(format!("MATH {target}.{} = {source}.{}", to.first, from.first));
    }
    let mask = (1_u32 << count) - 1;
    let taken = match from.first {
        0 => format!("{source} & 0x{mask:X}"),
        first => format!("{source} >> {first} & 0x{mask:X}"),
    };
    Some(match to.first {
        0 => format!("MATH {target} = ({target} & ~0x{mask:X}) | ({taken})"),
        first => format!(
            "MATH {target} = ({target} & ~(0x{mask:X} << {first})) | (({taken}) << {first})"
        ),
    })
}

/// A number of elements from a first one on, in order: `D10..D14`, `recipe[0..4]`.
fn elements(first: &str, count: &str) -> Option<String> {
    let first = first.trim_start_matches('#');
    let more = count.trim_start_matches('K').parse::<u32>().ok()?.checked_sub(1)?;
    let number = |digits: &str| digits.parse::<u32>().ok().filter(|number| *number < 1 << 20);
    if let Some((name, index)) = first.strip_suffix(']').and_then(|name| name.split_once('[')) {
        let index = number(index)?;
        return Some(format!("{name}[{index}..{}]", index + more.min(1 << 20)));
    }
    let letters = first.trim_end_matches(|c: char| c.is_ascii_digit());
    let is_space = Space::from_name(letters).is_some();
    match number(&first[letters.len()..]).filter(|_| is_space) {
        Some(number) => Some(format!("{first}..{letters}{}", number + more.min(1 << 20))),
        None if first.starts_with(|c: char| c.is_ascii_alphabetic()) => {
            Some(format!("{first}[0..{more}]"))
        }
        None => None,
    }
}

/// The text to write in a rungd ladder for a mnemonic of another controller (upper or lower case).
pub fn instead_of(name: &str) -> Option<&'static str> {
    let same = |other: &&str| other.eq_ignore_ascii_case(name);
    ROWS.iter().find(|(names, _)| names.iter().any(same)).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::isa::Mnemonic;

    #[test]
    fn no_foreign_name_is_an_instruction_and_every_suggestion_exists() {
        let mut seen = HashSet::new();
        for (names, text) in ROWS {
            for name in *names {
                assert!(seen.insert(name), "{name} has two rows");
                assert_eq!(Mnemonic::from_name(name), None, "{name} is an instruction");
            }
            let quoted = text.split('`').skip(1).step_by(2);
            for word in quoted.filter_map(|code| code.split_whitespace().next()) {
                let is_mnemonic = word.chars().all(|c| c.is_ascii_uppercase());
                assert!(!is_mnemonic || Mnemonic::from_name(word).is_some(), "{word}: {text}");
            }
        }
        assert_eq!(instead_of("ote"), Some("an output coil is `OUT b`"));
        assert_eq!(instead_of("CNT"), None);
    }

    #[test]
    fn foreign_contacts_and_coils_translate_with_their_operands() {
        let pairs = [
            ("XIC", &["b"][..], Some("b")),
            ("xio", &["b"], Some("!b")),
            ("LDP", &["b"], Some("rise(b)")),
            ("F_TRIG", &["b"], Some("fall(b)")),
            ("GEQ", &["D0", "3"], Some("D0 >= 3")),
            ("LIM", &["1", "D0", "9"], Some("D0 >= 1 & D0 <= 9")),
            ("XIC", &[], None),
            ("TON", &["t", "5"], None),
        ];
        for (name, operands, wanted) in pairs {
            assert_eq!(contact(name, operands).as_deref(), wanted, "{name}");
        }
        assert!(is_parallel("OR") && !is_parallel("AND"));
    }

    #[test]
    fn foreign_instructions_translate_with_their_operands() {
        let pairs = [
            ("ST", &["b"][..], Some("OUT b")),
            ("otu", &["b"], Some("RST b")),
            ("JSR", &["Fill", "0"], Some("CALL Fill")),
            ("GTS", &["K3"], Some("CALL K3")),
            ("JSR", &["3"], None),
            ("BMOV", &["D0", "D10", "5"], Some("COPY D0..D4 to=D10..D14")),
            ("BMOV", &["#D0", "R3", "K2"], Some("COPY D0..D1 to=R3..R4")),
            ("COP", &["a", "b[2]", "8"], Some("COPY a[0..7] to=b[2..9]")),
            ("COP", &["step7", "C1x", "2"], Some("COPY step7[0..1] to=C1x[0..1]")),
            ("COP", &["a", "b", "n"], None),
            ("COP", &["a", "b", "0"], None),
            ("FLL", &["0", "D3", "4"], Some("FILL 0 to=D3..D6")),
            ("BTD", &["a", "3", "b", "5", "1"], Some("MATH b.5 = a.3")),
            (
                "BTD",
                &["a", "3", "b", "4", "6"],
                Some("MATH b = (b & ~(0x3F << 4)) | ((a >> 3 & 0x3F) << 4)"),
            ),
            ("BTD", &["a", "0", "b", "0", "4"], Some("MATH b = (b & ~0xF) | (a & 0xF)")),
            ("BTD", &["a", "3", "b", "30", "6"], None),
            ("RET", &[], Some("RETURN")),
            ("BTD", &["a", "b"], None),
            ("XIC", &["b"], None),
        ];
        for (name, operands, wanted) in pairs {
            assert_eq!(instruction(name, operands).as_deref(), wanted, "{name} {operands:?}");
        }
    }
}
