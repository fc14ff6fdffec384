//! The page of every instruction, for `rungd explain`.
//!
//! The texts are in `docs/instructions/` and are compiled into the program, so that their version
//! is the program's version. A test compares them with the instruction table and draws their
//! diagrams.

use super::instruction::Mnemonic;

macro_rules! pages {
    ($($mnemonic:ident $name:literal)*) => {
        /// The page of an instruction.
        pub fn page(mnemonic: Mnemonic) -> &'static str {
            match mnemonic {
                $(Mnemonic::$mnemonic => {
                    include_str!(concat!("../../docs/instructions/", $name, ".md"))
                })*
            }
        }
    };
}

pages! {
    Out "out"
    Set "set"
    Rst "rst"
    Pd "pd"
    Nd "nd"
    Ponoff "ponoff"
    Cnt "cnt"
    Cntdn "cntdn"
    Udc "udc"
    Udcg "udcg"
    Rstct "rstct"
    Rstt "rstt"
    Ondtmr "ondtmr"
    Offdtmr "offdtmr"
    Tmr "tmr"
    Tmrdown "tmrdown"
    Tmra "tmra"
    Tmradown "tmradown"
    Tmrag "tmrag"
    Ctu "ctu"
    Ctd "ctd"
    Res "res"
    Move "move"
    Add "add"
    Sub "sub"
    Math "math"
    Copy "copy"
    Fill "fill"
    Sr "sr"
    Run "run"
    Restart "restart"
    Halt "halt"
    Exit "exit"
    Entask "entask"
    Jmp "jmp"
    Sgset "sgset"
    Sgrst "sgrst"
    Sgdivrg "sgdivrg"
    Sgconvrg "sgconvrg"
    Stop "stop"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::instruction::TABLE;

    #[test]
    fn every_instruction_has_its_page() {
        for spec in TABLE {
            let head = format!("# {}: {}\n", spec.name, spec.title);
            assert!(page(spec.mnemonic).starts_with(&head), "{head}");
        }
    }
}
