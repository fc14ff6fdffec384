//! The mutants of a small ladder as a list; and all mutants of the ladders that are shipped: each
//! differs from its ladder, no two are the same, and each runs.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use expect_test::{Expect, expect};

use super::{Mutant, MutantKind, mutants};
use crate::calendar::LocalTime;
use crate::engine::{self, Cell, Engine, EngineCall, ScanTimes};
use crate::isa::{Address, Bit, BitSpace, Word, WordSpace};
use crate::load::{controller_file, ladder_files};
use crate::lower::lower;
use crate::resolve::program::Program;
use crate::resolve::{LoadOptions, load_ladders};
use crate::source::span::SourceFile;

const PERIOD_MS: u32 = 10;

fn load(files: &[(&str, &str)]) -> (Program, Vec<SourceFile>) {
    let file = |(name, text): &(&str, &str)| SourceFile {
        name: (*name).to_owned(),
        text: (*text).to_owned(),
    };
    let files: Vec<SourceFile> = files.iter().map(file).collect();
    let (program, findings) = load_ladders(&files, &LoadOptions::default());
    (program.unwrap_or_else(|| panic!("{findings:#?}")), files)
}

/// The mutants of ladder files; each runs, and no two are the same.
fn check(files: &[(&str, &str)], expected: Expect) {
    let (program, files) = load(files);
    let mutants = mutants(&program, &files, PERIOD_MS);
    let mut text = String::new();
    let mut rung = "";
    for mutant in &mutants {
        if rung != mutant.rung {
            rung = &mutant.rung;
            let _ = writeln!(text, "{rung}");
        }
        let _ = writeln!(text, "  {}: {}", mutant.kind.name(), mutant.what);
    }
    expected.assert_eq(&text);
    try_all(&program, &mutants);
}

/// As [`check`], for the rungs of `Main`.
fn check_main(rungs: &str, expected: Expect) {
    let rungs: Vec<&str> = rungs.trim().lines().map(str::trim).collect();
    let text = format!(
        "[tags]\nbits = {{ at = \"C16\", count = 4 }}\nwords = {{ at = \"D16\", count = 4 }}\n\
         speed = {{ at = \"D20\", max = 9 }}\nlimit = {{ value = 80 }}\n\
         patience = {{ value = \"2s\" }}\n[[program]]\nname = \"Main\"\nrung = [\n{}\n]\n",
        rungs.join("\n")
    );
    check(&[("ladder.toml", &text)], expected);
}

/// Runs every mutant; each differs from the ladder and from each other one.
fn try_all(program: &Program, mutants: &[Mutant]) {
    let mut seen = HashMap::from([(digest(&lower(program).0), "the ladder itself".to_owned())]);
    let mut same = Vec::new();
    for mutant in mutants {
        let mutated = mutant.apply(program);
        let (code, _) = lower(&mutated);
        let name = format!("{}: {}", mutant.rung, mutant.what);
        if let Some(other) = seen.insert(digest(&code), name.clone()) {
            same.push(format!("{name} = {other}"));
        }
        run(&mutated, code);
    }
    assert!(same.is_empty(), "{same:#?}");
}

fn digest(code: &engine::Program) -> u64 {
    let mut hasher = DefaultHasher::new();
    format!("{code:?}").hash(&mut hasher);
    hasher.finish()
}

/// Runs 200 scans with inputs and words that change at random.
fn run(program: &Program, code: engine::Program) {
    let layout = code.layout.clone();
    let inputs = (0..program.sizes.x).take(16).map(|n| Address::Bit(Bit::Space(BitSpace::X, n)));
    let words = (0..8).map(|n| Address::Word(Word::Space(WordSpace::D, n)));
    let cells: Vec<Cell> = inputs.chain(words).filter_map(|at| layout.cell(at)).collect();
    let mut engine = Engine::new(code);
    engine.apply(EngineCall::Start { now_ns: 0 });
    let mut random = 0x2545_f491_4f6c_dd1d_u64;
    for scan in 0..200_u64 {
        engine.begin_scan(
            scan * u64::from(PERIOD_MS) * 1_000_000,
            &ScanTimes::default(),
            &LocalTime::of(LocalTime::SIMULATED_S),
        );
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let cell = cells[(random % cells.len() as u64) as usize];
        let value = (random >> 32) as i32 & if matches!(cell, Cell::Bit(_)) { 1 } else { 15 };
        engine.apply(EngineCall::Write(cell, value));
        if scan == 199 {
            engine.request_stop();
        }
        if engine.execute().last {
            engine.terminate();
        }
    }
}

#[test]
fn a_small_ladder() {
    check_main(
        r#"
        { name = "start", when = ["X0", "!X1"], do = ["OUT Y0"] },
        "#,
        expect![[r#"
            Main, rung start
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` left out
              inverted: contact `!X1` is `X1`
              contact-out: contact `!X1` left out
              instruction: `OUT Y0` is `SET Y0`
        "#]],
    );
}

#[test]
fn contacts_of_every_form() {
    check_main(
        r#"
        { when = ["X0 & (X1 | !X2)", "!(X3 & X4)", "$On"], do = ["OUT Y0"] },
        { when = ["rise(X0)"], do = ["SET C0", "RST C1"] },
        { when = ["!fall(X0 | X1)", "!!X2", "bits[D0]"], do = ["OUT Y1"] },
        { when = ["D0 >= limit", "D1 == 3", "7 < D2", "R0 > 2.5", "T0.Acc < 3s"], do = ["OUT Y2"] },
        { when = ["$On"], do = ["TMR T0 preset=3s"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              group: `X0 & (X1 | !X2)` is `X0 | (X1 | !X2)`
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` left out
              group: `(X1 | !X2)` is `(X1 & !X2)`
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` left out
              inverted: contact `!X2` is `X2`
              contact-out: contact `!X2` left out
              inverted: contact `!(X3 & X4)` is `(X3 & X4)`
              group: `(X3 & X4)` is `(X3 | X4)`
              inverted: contact `X3` is `!X3`
              contact-out: contact `X3` left out
              inverted: contact `X4` is `!X4`
              contact-out: contact `X4` left out
              instruction: `OUT Y0` is `SET Y0`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `rise(X0)` is `!rise(X0)`
              contact-out: contact `rise(X0)` is always ON
              level: `rise(X0)` is `X0`
              other-edge: `rise(X0)` is `fall(X0)`
              instruction-out: `SET C0` left out
              instruction: `SET C0` is `RST C0`
              instruction-out: `RST C1` left out
              instruction: `RST C1` is `SET C1`
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `!fall(X0 | X1)` is `fall(X0 | X1)`
              contact-out: contact `!fall(X0 | X1)` left out
              level: `fall(X0 | X1)` is `X0 | X1`
              other-edge: `fall(X0 | X1)` is `rise(X0 | X1)`
              group: `X0 | X1` is `X0 & X1`
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` left out
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` left out
              inverted: contact `!!X2` is `!X2`
              contact-out: contact `!!X2` left out
              inverted: contact `bits[D0]` is `!bits[D0]`
              contact-out: contact `bits[D0]` left out
              instruction: `OUT Y1` is `SET Y1`
            Main, rung 4
              rung-out: the rung left out
              inverted: contact `D0 >= limit` is `D0 < limit`
              contact-out: contact `D0 >= limit` left out
              border: `D0 >= limit` is `D0 > limit`
              number: `limit` (80) is 79 in `D0 >= limit`
              inverted: contact `D1 == 3` is `D1 != 3`
              contact-out: contact `D1 == 3` left out
              number: 3 is 4 in `D1 == 3`
              number: 3 is 2 in `D1 == 3`
              inverted: contact `7 < D2` is `7 >= D2`
              contact-out: contact `7 < D2` left out
              border: `7 < D2` is `7 <= D2`
              number: 7 is 8 in `7 < D2`
              inverted: contact `R0 > 2.5` is `R0 <= 2.5`
              contact-out: contact `R0 > 2.5` left out
              border: `R0 > 2.5` is `R0 >= 2.5`
              number: 2.5 is 2.525 in `R0 > 2.5`
              number: 2.5 is 2.475 in `R0 > 2.5`
              inverted: contact `T0.Acc < 3s` is `T0.Acc >= 3s`
              contact-out: contact `T0.Acc < 3s` left out
              border: `T0.Acc < 3s` is `T0.Acc <= 3s`
              number: 3s is 2s990ms in `T0.Acc < 3s`
              instruction: `OUT Y2` is `SET Y2`
            Main, rung 5
              rung-out: the rung left out
              number: preset 3s is 3s10ms in `TMR T0 preset=3s`
              number: preset 3s is 2s990ms in `TMR T0 preset=3s`
        "#]],
    );
}

#[test]
fn every_instruction_of_a_program() {
    check_main(
        r#"
        { when = ["$On"], do = ["OUT Y0"] },
        { when = ["X0"], do = ["OUT Y1", "PD C0", "ND C1", "PONOFF C2"] },
        { leg.up = ["rise(X0)"], leg.rst = ["$Off"], do = ["CNT CT0 preset=12"] },
        { leg.dn = ["X0"], leg.rst = ["X1"], do = ["CNTDN CT1 preset=0"] },
        { leg.up = ["X0"], leg.dn = ["X1"], leg.rst = ["X2"], do = ["UDC CT2 up-preset=-1"] },
        { leg.up = ["X0"], leg.dn = ["X1"], do = ["UDCG CT3 up-preset=9 dn-preset=1"] },
        { when = ["X2"], do = ["RSTCT CT3", "RSTT T4", "RES N0"] },
        { when = ["X0"], do = ["ONDTMR T0 preset=3s output=Y2", "OFFDTMR T1 preset=5ms output=Y3"] },
        { when = ["X0"], do = ["TMR T2 preset=D0", "TMRDOWN T3 preset=1m", "TMRAG T4 preset=patience"] },
        { leg.en = ["X0"], leg.rst = ["X1"], do = ["TMRA T5 preset=1s"] },
        { leg.en = ["X0"], leg.rst = ["X1"], do = ["TMRADOWN T6 preset=1s"] },
        { when = ["X0"], do = ["CTU N0 preset=5", "CTD N0", "CTU N1 preset=3", "CTD N1 preset=3"] },
        { when = ["X0"], do = ["MOVE 65535 to=V0", "MOVE 2s to=D0", "MOVE 1.5 to=R0", "MOVE 9 to=speed"] },
        { when = ["X0"], do = ["ADD D0 1 to=D1", "SUB D0 0 to=D2", "MOVE 7 to=words[D3]"] },
        { when = ["X0"], do = ["COPY C0..C3 to=C4..C7", "FILL 0 to=C8..C9", "FILL 3 to=D8..D9"] },
        { when = ["X0"], do = ["SET bits[D0]"] },
        { leg.data = ["X0"], leg.clk = ["X1"], leg.rst = ["X2"], do = ["SR C4..C7"] },
        { when = ["X9"], do = ["STOP"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `OUT Y1` left out
              instruction: `OUT Y1` is `SET Y1`
              instruction-out: `PD C0` left out
              instruction: `PD C0` is `ND C0`
              instruction-out: `ND C1` left out
              instruction: `ND C1` is `PD C1`
              instruction-out: `PONOFF C2` left out
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `rise(X0)` is `!rise(X0)`
              contact-out: contact `rise(X0)` is always ON
              other-edge: `rise(X0)` is `fall(X0)`
              number: preset 12 is 13 in `CNT CT0 preset=12`
              number: preset 12 is 11 in `CNT CT0 preset=12`
            Main, rung 4
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              number: preset 0 is 1 in `CNTDN CT1 preset=0`
            Main, rung 5
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              inverted: contact `X2` is `!X2`
              contact-out: contact `X2` is always ON
              number: up-preset -1 is 0 in `UDC CT2 up-preset=-1`
              number: up-preset -1 is -2 in `UDC CT2 up-preset=-1`
            Main, rung 6
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              number: up-preset 9 is 10 in `UDCG CT3 up-preset=9 dn-preset=1`
              number: up-preset 9 is 8 in `UDCG CT3 up-preset=9 dn-preset=1`
              number: dn-preset 1 is 2 in `UDCG CT3 up-preset=9 dn-preset=1`
              number: dn-preset 1 is 0 in `UDCG CT3 up-preset=9 dn-preset=1`
            Main, rung 7
              rung-out: the rung left out
              inverted: contact `X2` is `!X2`
              contact-out: contact `X2` is always ON
              instruction-out: `RSTCT CT3` left out
              instruction-out: `RSTT T4` left out
              instruction-out: `RES N0` left out
            Main, rung 8
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `ONDTMR T0 preset=3s output=Y2` left out
              number: preset 3s is 3s10ms in `ONDTMR T0 preset=3s output=Y2`
              number: preset 3s is 2s990ms in `ONDTMR T0 preset=3s output=Y2`
              instruction-out: `OFFDTMR T1 preset=5ms output=Y3` left out
              number: preset 5ms is 15ms in `OFFDTMR T1 preset=5ms output=Y3`
            Main, rung 9
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `TMR T2 preset=D0` left out
              instruction-out: `TMRDOWN T3 preset=1m` left out
              number: preset 1m is 1m10ms in `TMRDOWN T3 preset=1m`
              number: preset 1m is 59s990ms in `TMRDOWN T3 preset=1m`
              instruction-out: `TMRAG T4 preset=patience` left out
              number: preset `patience` (2s) is 2s10ms in `TMRAG T4 preset=patience`
              number: preset `patience` (2s) is 1s990ms in `TMRAG T4 preset=patience`
            Main, rung 10
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              number: preset 1s is 1s10ms in `TMRA T5 preset=1s`
              number: preset 1s is 990ms in `TMRA T5 preset=1s`
            Main, rung 11
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              number: preset 1s is 1s10ms in `TMRADOWN T6 preset=1s`
              number: preset 1s is 990ms in `TMRADOWN T6 preset=1s`
            Main, rung 12
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `CTU N0 preset=5` left out
              number: preset 5 is 6 in `CTU N0 preset=5`
              number: preset 5 is 4 in `CTU N0 preset=5`
              instruction-out: `CTD N0` left out
              instruction-out: `CTU N1 preset=3` left out
              instruction-out: `CTD N1 preset=3` left out
            Main, rung 13
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `MOVE 65535 to=V0` left out
              number: 65535 is 65534 in `MOVE 65535 to=V0`
              instruction-out: `MOVE 2s to=D0` left out
              number: 2s is 2s10ms in `MOVE 2s to=D0`
              number: 2s is 1s990ms in `MOVE 2s to=D0`
              instruction-out: `MOVE 1.5 to=R0` left out
              number: 1.5 is 1.515 in `MOVE 1.5 to=R0`
              number: 1.5 is 1.485 in `MOVE 1.5 to=R0`
              instruction-out: `MOVE 9 to=speed` left out
              number: 9 is 8 in `MOVE 9 to=speed`
            Main, rung 14
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `ADD D0 1 to=D1` left out
              instruction: `ADD D0 1 to=D1` is `SUB D0 1 to=D1`
              number: 1 is 2 in `ADD D0 1 to=D1`
              number: 1 is 0 in `ADD D0 1 to=D1`
              instruction-out: `SUB D0 0 to=D2` left out
              number: 0 is 1 in `SUB D0 0 to=D2`
              number: 0 is -1 in `SUB D0 0 to=D2`
              instruction-out: `MOVE 7 to=words[D3]` left out
              number: 7 is 8 in `MOVE 7 to=words[D3]`
              number: 7 is 6 in `MOVE 7 to=words[D3]`
            Main, rung 15
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `COPY C0..C3 to=C4..C7` left out
              instruction-out: `FILL 0 to=C8..C9` left out
              number: 0 is 1 in `FILL 0 to=C8..C9`
              instruction-out: `FILL 3 to=D8..D9` left out
              number: 3 is 4 in `FILL 3 to=D8..D9`
              number: 3 is 2 in `FILL 3 to=D8..D9`
            Main, rung 16
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction: `SET bits[D0]` is `RST bits[D0]`
            Main, rung 17
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              inverted: contact `X2` is `!X2`
              contact-out: contact `X2` is always ON
            Main, rung 18
              rung-out: the rung left out
              inverted: contact `X9` is `!X9`
              contact-out: contact `X9` is always ON
        "#]],
    );
}

#[test]
fn formulas() {
    check_main(
        r#"
        { when = ["X0"], do = ["MATH D0 = (D1 + 3) * -D2 - 2s"] },
        { when = ["X0"], do = ["MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2"] },
        { when = ["X0"], do = ["MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)"] },
        { when = ["X0"], do = ["MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1"] },
        { when = ["X0"], do = ["MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `+` is `-` in `(D1 + 3)`
              operator: `*` is `/` in `(D1 + 3) * -D2`
              operator: `-` is `+` in `(D1 + 3) * -D2 - 2s`
              number: 3 is 4 in `MATH D0 = (D1 + 3) * -D2 - 2s`
              number: 3 is 2 in `MATH D0 = (D1 + 3) * -D2 - 2s`
              sign-out: `-` left out in `-D2`
              number: 2s is 2s10ms in `MATH D0 = (D1 + 3) * -D2 - 2s`
              number: 2s is 1s990ms in `MATH D0 = (D1 + 3) * -D2 - 2s`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `&&` is `||` in `(D1 < 5 && !(X1 == 1))`
              operator: `||` is `&&` in `(D1 < 5 && !(X1 == 1)) || 7 >= D2`
              operator: `<` is `<=` in `D1 < 5`
              number: 5 is 4 in `MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2`
              sign-out: `!` left out in `!(X1 == 1)`
              operator: `==` is `!=` in `(X1 == 1)`
              number: 1 is 2 in `MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2`
              number: 1 is 0 in `MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2`
              number: 7 is 8 in `MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2`
              operator: `>=` is `>` in `7 >= D2`
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `max` is `min` in `max(R1, 0.0)`
              operator: `/` is `*` in `max(R1, 0.0) / 2.0 ** round(R2)`
              number: 0.0 is 1.0 in `MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)`
              number: 0.0 is -1.0 in `MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)`
              number: 2.0 is 2.02 in `MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)`
              number: 2.0 is 1.98 in `MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)`
              operator: `**` is `*` in `2.0 ** round(R2)`
              operator: `round` is `trunc` in `round(R2)`
            Main, rung 4
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              number: 10 is 11 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              number: 10 is 9 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              operator: `%` is `*` in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              sign-out: `~` left out in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              operator: `+` is `-` in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              number: 1 is 2 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              number: 1 is 0 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              operator: `<<` is `>>` in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              operator: `+` is `-` in `D4 + 1`
              number: 1 is 2 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              number: 1 is 0 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
            Main, rung 5
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `^` is `&` in `if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              operator: `&` is `|` in `D1 & 1`
              number: 1 is 2 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 1 is 0 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 1 is 2 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 1 is 0 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 0 is 1 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 0 is -1 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 0xff is 256 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 0xff is 254 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
        "#]],
    );
}

#[test]
fn blocks_and_stages() {
    let ladder = r#"
        [[program]]
        name = "Main"
        rung = [
            { when = ["rise(X0)"], do = ["RESTART Fill"] },
            { when = ["X1"], do = ["ENTASK Log every=1s", "HALT Fill", "RUN Fill"] },
            { when = ["rise(X2)"], do = ["ENTASK Once"] },
        ]
        [[program]]
        name = "Fill"
        [[program.stage]]
        name = "Open"
        [[program.stage.rung]]
        when = ["$On"]
        do = ["OUT Y0"]
        [[program.stage.rung]]
        when = ["X9"]
        [[program.stage.rung.branch]]
        when = ["X3"]
        do = ["JMP Wait"]
        [[program.stage]]
        name = "Wait"
        [[program.stage.rung]]
        when = ["X4"]
        do = ["SGDIVRG Open Left"]
        [[program.stage.rung.branch]]
        when = ["X5"]
        do = ["SGSET Right", "SGRST Left"]
        [[program.stage]]
        name = "Left"
        [[program.stage.rung]]
        when = ["X6"]
        do = ["SGCONVRG Left Right to=Open"]
        [[program.stage]]
        name = "Right"
        [[program.stage.rung]]
        when = ["X7"]
        do = ["EXIT"]
        [[task]]
        name = "Log"
        rung = [{ when = ["$On"], do = ["MOVE 1 to=D0"] }]
        [[task]]
        name = "Once"
        rung = [{ when = ["$On"], do = ["MOVE 2 to=D0"] }]
        "#;
    check(
        &[("ladder.toml", ladder)],
        expect![[r#"
        Main, rung 1
          rung-out: the rung left out
          inverted: contact `rise(X0)` is `!rise(X0)`
          contact-out: contact `rise(X0)` is always ON
          other-edge: `rise(X0)` is `fall(X0)`
        Main, rung 2
          rung-out: the rung left out
          inverted: contact `X1` is `!X1`
          contact-out: contact `X1` is always ON
          instruction-out: `ENTASK Log every=1s` left out
          number: every 1s is 1s10ms in `ENTASK Log every=1s`
          number: every 1s is 990ms in `ENTASK Log every=1s`
          instruction-out: `HALT Fill` left out
          instruction-out: `RUN Fill` left out
        Main, rung 3
          rung-out: the rung left out
          inverted: contact `rise(X2)` is `!rise(X2)`
          contact-out: contact `rise(X2)` is always ON
          other-edge: `rise(X2)` is `fall(X2)`
        Fill.Open, rung 1
          rung-out: the rung left out
          instruction: `OUT Y0` is `SET Y0`
        Fill.Open, rung 2
          rung-out: the rung left out
          inverted: contact `X9` is `!X9`
          contact-out: contact `X9` is always ON
        Fill.Open, rung 2, branch 1
          inverted: contact `X3` is `!X3`
          contact-out: contact `X3` is always ON
          stage: `Wait` is `Left` in `JMP Wait`
        Fill.Wait, rung 1
          rung-out: the rung left out
          inverted: contact `X4` is `!X4`
          contact-out: contact `X4` is always ON
          instruction-out: `SGDIVRG Open Left` left out
          stage: `Open` is `Wait` in `SGDIVRG Open Left`
          stage: `Left` is `Right` in `SGDIVRG Open Left`
        Fill.Wait, rung 1, branch 1
          inverted: contact `X5` is `!X5`
          contact-out: contact `X5` is always ON
          branch-out: the branch left out
          instruction-out: `SGSET Right` left out
          instruction-out: `SGRST Left` left out
        Fill.Left, rung 1
          rung-out: the rung left out
          inverted: contact `X6` is `!X6`
          contact-out: contact `X6` is always ON
          stage: `Open` is `Wait` in `SGCONVRG Left Right to=Open`
        Fill.Right, rung 1
          rung-out: the rung left out
          inverted: contact `X7` is `!X7`
          contact-out: contact `X7` is always ON
        Log, rung 1
          rung-out: the rung left out
          number: 1 is 2 in `MOVE 1 to=D0`
          number: 1 is 0 in `MOVE 1 to=D0`
        Once, rung 1
          rung-out: the rung left out
          number: 2 is 3 in `MOVE 2 to=D0`
          number: 2 is 1 in `MOVE 2 to=D0`
    "#]],
    );
}

const PUMP: &str = r#"
[[template]]
name = "Pump"
[template.parameters]
wanted   = { type = "contact" }
feedback = { type = "bit" }
motor    = { type = "output" }
least    = { type = "int" }
patience = { type = "duration", default = "3s" }
[template.tags]
failed = { type = "bit" }
late   = { type = "timer" }
[[template.rung]]
name = "start"
when = ["wanted", "!failed", "D0 >= least"]
do   = ["OUT motor"]
[[template.rung]]
when = ["motor", "!feedback | wanted"]
do   = ["TMR late preset=patience"]
[[template.rung]]
when = ["late.Done", "!(wanted | motor)", "rise(wanted)"]
do   = ["SET failed"]
"#;

const PUMPS: &str = r#"
[[program]]
name = "Main"
[[program.rung]]
use  = "Pump"
name = "p1"
with = { wanted = "X0 & X1", feedback = "X2", motor = "Y0", least = 5 }
[[program.rung]]
use  = "Pump"
name = "p2"
with = { wanted = "X3", feedback = "X4", motor = "Y1", least = 6, patience = "5s" }
"#;

#[test]
fn a_slip_in_a_template_is_in_all_its_uses_and_one_in_an_argument_in_one() {
    check(
        &[("pump.toml", PUMP), ("plant.toml", PUMPS)],
        expect![[r#"
            Main, rung 2
              number: preset 3s is 3s10ms in `TMR late preset=patience`
              number: preset 3s is 2s990ms in `TMR late preset=patience`
            Main, rung p1/start
              rung-out: the rung left out (at 2 places)
              inverted: contact `!failed` is `failed` (at 2 places)
              contact-out: contact `!failed` left out (at 2 places)
              inverted: contact `D0 >= least` is `D0 < least` (at 2 places)
              contact-out: contact `D0 >= least` left out (at 2 places)
              border: `D0 >= least` is `D0 > least` (at 2 places)
              number: `least` (5) is 4 in `D0 >= least` (alike at 2 places)
              instruction: `OUT motor` is `SET motor` (at 2 places)
            Main, rung 2
              rung-out: the rung left out (at 2 places)
              inverted: contact `motor` is `!motor` (at 2 places)
              contact-out: contact `motor` left out (at 2 places)
              group: `!feedback | wanted` is `!feedback & wanted` (at 2 places)
              inverted: contact `!feedback` is `feedback` (at 2 places)
              contact-out: contact `!feedback` left out (at 2 places)
            Main, rung 3
              rung-out: the rung left out (at 2 places)
              inverted: contact `late.Done` is `!late.Done` (at 2 places)
              contact-out: contact `late.Done` left out (at 2 places)
              inverted: contact `!(wanted | motor)` is `(wanted | motor)` (at 2 places)
              group: `(wanted | motor)` is `(wanted & motor)` (at 2 places)
              inverted: contact `motor` is `!motor` (at 2 places)
              contact-out: contact `motor` left out (at 2 places)
              inverted: contact `rise(wanted)` is `!rise(wanted)` (at 2 places)
              contact-out: contact `rise(wanted)` left out (at 2 places)
              level: `rise(wanted)` is `wanted` (at 2 places)
              other-edge: `rise(wanted)` is `fall(wanted)` (at 2 places)
              instruction: `SET failed` is `RST failed` (at 2 places)
            Main, rung p1/start
              group: `X0 & X1` is `X0 | X1` (at 4 places)
              inverted: contact `X0` is `!X0` (at 4 places)
              contact-out: contact `X0` left out (at 4 places)
              inverted: contact `X1` is `!X1` (at 4 places)
              contact-out: contact `X1` left out (at 4 places)
            Main, rung p2/start
              inverted: contact `X3` is `!X3` (at 3 places)
              contact-out: contact `X3` left out (at 3 places)
            Main, rung 5
              number: preset 5s is 5s10ms in `TMR late preset=patience`
              number: preset 5s is 4s990ms in `TMR late preset=patience`
        "#]],
    );
}

#[test]
fn the_library_is_not_changed_unless_nothing_else_is_there() {
    let own = format!("{PUMPS}[[program.rung]]\nwhen = [\"X7\"]\ndo = [\"OUT Y7\"]\n");
    check(
        &[("lib:pump", PUMP), ("plant.toml", &own)],
        expect![[r#"
            Main, rung p1/start
              group: `X0 & X1` is `X0 | X1` (at 4 places)
              inverted: contact `X0` is `!X0` (at 4 places)
              contact-out: contact `X0` left out (at 4 places)
              inverted: contact `X1` is `!X1` (at 4 places)
              contact-out: contact `X1` left out (at 4 places)
            Main, rung p2/start
              inverted: contact `X3` is `!X3` (at 3 places)
              contact-out: contact `X3` left out (at 3 places)
            Main, rung 5
              number: preset 5s is 5s10ms in `TMR late preset=patience`
              number: preset 5s is 4s990ms in `TMR late preset=patience`
            Main, rung 7
              rung-out: the rung left out
              inverted: contact `X7` is `!X7`
              contact-out: contact `X7` is always ON
              instruction: `OUT Y7` is `SET Y7`
        "#]],
    );
    let (program, files) = load(&[("lib:pump", PUMP), ("plant.toml", PUMPS)]);
    let places = mutants(&program, &files, PERIOD_MS).into_iter().map(|mutant| mutant.span.file.0);
    assert!(places.clone().any(|file| file == 0) && places.clone().any(|file| file == 1));
}

#[test]
fn the_table_of_kinds() {
    for kind in MutantKind::ALL {
        assert_eq!(MutantKind::from_name(kind.name()), Some(*kind));
        assert!(kind.doc().ends_with('.'), "{}", kind.name());
    }
}

fn files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("one"));
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    files.sort();
    files
}

/// Tries all mutants of a program that is shipped; their number and that of each kind.
fn count(name: &Path, program: &Program, files: &[SourceFile]) -> String {
    let mutants = mutants(program, files, PERIOD_MS);
    let again = super::mutants(program, files, PERIOD_MS);
    let said = |mutants: &[Mutant]| format!("{mutants:?}");
    assert_eq!(said(&mutants), said(&again));
    try_all(program, &mutants);
    let mut text = format!("{}: {}", name.file_stem().unwrap_or_default().display(), mutants.len());
    for kind in MutantKind::ALL {
        let count = mutants.iter().filter(|mutant| mutant.kind == *kind).count();
        if count > 0 {
            let _ = write!(text, ", {} {count}", kind.name());
        }
    }
    text + "\n"
}

#[test]
fn all_mutants_of_the_ladders_in_config() {
    let mut text = String::new();
    for path in files("config").into_iter().chain(files("config/first")) {
        let loaded = controller_file(&path).expect("a controller file");
        let program = loaded.program.expect("a program");
        text += &count(&path, &program, &loaded.files);
    }
    expect![[r#"
        batch-mixer: 179, rung-out 31, inverted 43, contact-out 43, group 5, border 1, level 3, other-edge 3, number 16, instruction-out 13, instruction 15, stage 6
        bin-emptying: 57, rung-out 8, inverted 14, contact-out 14, group 2, border 2, level 2, other-edge 2, number 3, instruction-out 2, instruction 8
        bottling-plant: 174, rung-out 17, inverted 49, contact-out 49, group 14, border 3, level 3, other-edge 3, number 11, instruction-out 7, instruction 18
        car-park: 60, rung-out 10, inverted 13, contact-out 13, group 3, border 2, level 1, other-edge 1, number 9, instruction-out 2, instruction 6
        conveyor: 82, rung-out 12, branch-out 1, inverted 25, contact-out 25, group 3, level 2, other-edge 2, number 4, instruction-out 1, instruction 7
        filling-line: 181, rung-out 17, branch-out 2, inverted 35, contact-out 35, group 6, border 2, level 6, other-edge 6, number 35, instruction-out 9, instruction 13, operator 15
        lift-station: 130, rung-out 9, inverted 42, contact-out 42, group 13, level 3, other-edge 3, number 8, instruction-out 2, instruction 8
        lubrication: 59, rung-out 7, inverted 13, contact-out 13, level 2, other-edge 2, number 6, instruction-out 7, instruction 9
        parts-bin: 44, rung-out 9, inverted 11, contact-out 11, border 1, level 1, other-edge 1, number 6, instruction 4
        pump-station: 155, rung-out 19, branch-out 1, inverted 41, contact-out 41, group 12, border 1, level 3, other-edge 3, number 15, instruction-out 9, instruction 10
        rungd: 44, rung-out 9, inverted 11, contact-out 11, border 1, level 1, other-edge 1, number 6, instruction 4
        temperature-loop: 59, rung-out 7, inverted 16, contact-out 16, group 4, border 1, level 1, other-edge 1, number 7, instruction 4, operator 2
        traffic-light: 189, rung-out 41, inverted 48, contact-out 48, group 7, number 18, instruction-out 2, instruction 12, stage 13
        controller: 39, rung-out 6, inverted 12, contact-out 12, group 1, number 4, instruction 4
    "#]].assert_eq(&text);
}

#[test]
fn all_mutants_of_the_library() {
    let mut text = String::new();
    for path in files("config/lib") {
        let file = path.file_name().expect("a name");
        let user = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/lib/diagrams").join(file);
        let loaded = ladder_files(&[path.clone(), user]).expect("readable files");
        let program = loaded.program.expect("a program");
        text += &count(&path, &program, &loaded.files);
    }
    expect![[r#"
        alternate: 15, rung-out 3, inverted 4, contact-out 4, level 1, other-edge 1, instruction 2
        debounce: 23, rung-out 3, inverted 7, contact-out 7, group 1, number 4, instruction 1
        first-out: 53, rung-out 6, branch-out 3, inverted 9, contact-out 9, group 2, level 3, other-edge 3, number 12, instruction 6
        flasher: 21, rung-out 3, inverted 2, contact-out 2, border 1, number 9, instruction 1, operator 3
        hour-meter: 29, rung-out 4, inverted 4, contact-out 4, border 1, number 9, instruction-out 3, instruction 4
        hysteresis: 14, rung-out 1, inverted 3, contact-out 3, group 2, border 2, number 2, instruction 1
        lead-lag: 149, rung-out 8, branch-out 6, inverted 14, contact-out 14, group 2, border 5, level 1, other-edge 1, number 49, instruction-out 8, instruction 10, operator 28, sign-out 3
        pid: 136, rung-out 6, inverted 6, contact-out 6, number 54, instruction-out 21, operator 43
        ramp: 68, rung-out 6, branch-out 1, inverted 8, contact-out 8, group 1, border 2, number 24, instruction-out 4, instruction 1, operator 12, sign-out 1
        scaling: 47, rung-out 3, branch-out 1, inverted 5, contact-out 5, group 1, border 4, number 22, instruction-out 2, instruction 2, operator 2
    "#]].assert_eq(&text);
}
