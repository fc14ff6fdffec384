//! Compares the flow of power with the logic of the rung, with random contacts. `tests` calls this
//! for every shipped rung.

use std::cell::RefCell;
use std::collections::BTreeMap;

use expect_test::expect;

use super::circuit::{Circuit, ContactForm, ContactSymbol, InstructionSymbol, Outlet, RungCircuit};
use super::grid::RungGrid;
use super::power::{FlowOfPower, flow_of_power};
use super::read_back::expected;
use super::text::powered;
use super::wording::{OperandLabel, Wording};
use rungd_base::random::SplitMix64;
use rungd_language::resolve::program::Rung;

/// Gives the contacts random values, and compares the power at the outlets with the logic of the
/// rung.
pub(super) fn hold_against_the_rung(grid: &RungGrid, rung: &Rung, wording: &Wording) {
    let mut random = SplitMix64(11);
    for _ in 0..60 {
        let known: RefCell<BTreeMap<String, bool>> = RefCell::default();
        let mut truth = |statement: String| {
            let value = !random.next().is_multiple_of(3);
            *known.borrow_mut().entry(statement).or_insert(value)
        };
        for contact in &grid.contacts {
            truth(statement(&contact.symbol).0);
        }
        let conducts = |symbol: &ContactSymbol| {
            let (statement, plain) = statement(symbol);
            known.borrow()[&statement] == plain
        };
        let flow = flow_of_power(grid, &conducts);
        let mut powers = Vec::new();
        for (placed, outlets) in grid.instructions.iter().zip(&flow.outlets) {
            match placed.legs.is_empty() {
                true => powers.push((placed.row, "", outlets[0])),
                false => powers.extend(
                    placed.legs.iter().zip(outlets).map(|((leg, row), on)| (*row, *leg, *on)),
                ),
            }
        }
        powers.sort_by_key(|(row, ..)| *row);
        let powers: Vec<_> = powers.into_iter().map(|(_, leg, on)| (leg.to_owned(), on)).collect();
        let wanted = expected(rung, wording, &|statement| known.borrow()[statement]);
        let wanted: Vec<_> = wanted.into_iter().map(|(leg, _, on)| (leg, on)).collect();
        assert_eq!(powers, wanted, "{:?}\n{grid:?}", known.borrow());
        hold_against_wires(grid, &flow);
    }
}

/// Checks that touching wires have the same power, and that a conducting contact passes power on.
fn hold_against_wires(grid: &RungGrid, flow: &FlowOfPower) {
    for (contact, power) in grid.contacts.iter().zip(&flow.contacts) {
        assert!(!(power.before && power.conducts) || power.behind, "{contact:?} {power:?}");
        assert!(contact.column > 0 || power.before, "the rail has power: {contact:?}");
    }
    for (along, has_power) in grid.along.iter().zip(&flow.along) {
        for (down, power_down) in grid.down.iter().zip(&flow.down) {
            let touch = (along.from..=along.to).contains(&down.line)
                && (down.from..=down.to).contains(&along.line);
            assert!(!touch || has_power == power_down, "{along:?} and {down:?} of {grid:?}");
        }
    }
}

/// The statement at a contact, and whether the contact conducts while the statement is true.
fn statement(symbol: &ContactSymbol) -> (String, bool) {
    let name = &symbol.label.name;
    match symbol.form {
        ContactForm::Open | ContactForm::Boxed => (name.clone(), true),
        ContactForm::Closed | ContactForm::NotBoxed => (name.clone(), false),
        ContactForm::Rising => (format!("P {name}"), true),
        ContactForm::NotRising => (format!("P {name}"), false),
        ContactForm::Falling => (format!("N {name}"), true),
        ContactForm::NotFalling => (format!("N {name}"), false),
    }
}

fn contact(leaf: usize) -> Circuit {
    let label = OperandLabel { name: format!("X{leaf}"), ..OperandLabel::default() };
    Circuit::Contact(ContactSymbol { form: ContactForm::Open, label, branch: None, leaf })
}

fn coil() -> InstructionSymbol {
    let (mnemonic, coil) = ("OUT", Some(""));
    let label = OperandLabel { name: "Y0".to_owned(), ..OperandLabel::default() };
    InstructionSymbol { mnemonic, coil, label, operands: Vec::new() }
}

/// Two parallel contacts, then a third one in series, and a coil.
fn grid() -> RungGrid {
    let beside = Circuit::Parallel(vec![contact(0), contact(1)]);
    let circuit = Circuit::Series(vec![beside, contact(2)]);
    RungGrid::of(&RungCircuit::Plain(circuit, vec![Outlet::Instruction(coil())]))
}

#[test]
fn a_contact_parallel_to_a_conducting_one_has_power_on_both_sides() {
    let flow = flow_of_power(&grid(), &|symbol| symbol.leaf == 1);
    let seen = flow.contacts.iter().map(|of| (of.before, of.conducts, of.behind));
    let beside = (true, false, true);
    assert_eq!(seen.collect::<Vec<_>>(), [beside, (true, true, true), (true, false, false)]);
    assert_eq!(flow.outlets, [[false]]);
}

#[test]
fn power_does_not_flow_back_through_a_contact() {
    let flow = flow_of_power(&grid(), &|symbol| symbol.leaf == 2);
    assert!(flow.contacts[2].conducts && !flow.contacts[2].before && !flow.contacts[2].behind);
    assert_eq!(flow.outlets, [[false]]);
}

#[test]
fn an_empty_rung_has_no_power_to_show() {
    let flow = flow_of_power(&RungGrid::default(), &|_| true);
    assert_eq!(flow, FlowOfPower::default());
}

#[test]
fn elements_with_power_are_drawn_heavy_and_marked() {
    let drawn = |conducting: &[usize]| {
        let flow = flow_of_power(&grid(), &|symbol| conducting.contains(&symbol.leaf));
        powered(&grid(), Some(&flow), 30).lines.join("\n")
    };
    expect![[r#"
        ┃ X0    X2           Y0      │
        ┣━] [━┳━] [─────────( )──────┤
        ┃ X1  ┃                      │
        ┣━]●[━┛                      │"#]]
    .assert_eq(&drawn(&[1]));
    expect![[r#"
        ┃ X0    X2           Y0      │
        ┣━]●[━┳━]●[━━━━━━━━━(●)──────┤
        ┃ X1  ┃                      │
        ┣━] [━┛                      │"#]]
    .assert_eq(&drawn(&[0, 2]));
    let idle = powered(&grid(), None, 30);
    expect![[r#"
        │ X0    X2           Y0      │
        ├─] [─┬─] [─────────( )──────┤
        │ X1  │                      │
        ├─] [─┘                      │"#]]
    .assert_eq(&idle.lines.join("\n"));
    let operands: Vec<_> = idle.symbols.iter().map(|of| of.operand.as_str()).collect();
    assert_eq!(operands, ["X0", "X1", "X2", "Y0"]);
    for symbol in idle.symbols {
        let line: Vec<char> = idle.lines[symbol.line].chars().collect();
        assert!("](".contains(line[symbol.columns.start]), "{symbol:?}");
    }
}

#[test]
fn the_operand_of_a_box_is_its_first_name() {
    let legs = vec![("enable", contact(0)), ("reset", contact(1))];
    let operands = ["1s", "to=D1"].map(str::to_owned).to_vec();
    let label = OperandLabel::default();
    let symbol = InstructionSymbol { mnemonic: "TMR", coil: None, label, operands };
    let grid = RungGrid::of(&RungCircuit::Legs(legs, symbol));
    let flow = flow_of_power(&grid, &|symbol| symbol.leaf == 0);
    let drawn = powered(&grid, Some(&flow), 0);
    expect![[r#"
        ┃ X0    ┌─────────────────────┐ │
        ┣━]●[━━━┫●enable TMR 1s to=D1 ├─┤
        ┃ X1    │                     │ │
        ┣━] [───┤ reset               │ │
        ┃       └─────────────────────┘ │"#]]
    .assert_eq(&drawn.lines.join("\n"));
    assert_eq!(drawn.symbols[2].operand, "D1");
}
