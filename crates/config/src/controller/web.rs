//! `[web]` and `[[panel]]`: the operands that users of `rungd web` may write, and the panels that
//! the owner of the controller lays out. The daemon uses the rights alone: `rungd web` reads the
//! panels from the controller file of the running program. `panel` reads the parts of a panel,
//! `user` the roles of users.

use std::collections::{HashMap, HashSet};

use super::panel::{
    ALL_ALARMS, Panel, Widget, WidgetKind, WrittenPanel, is_drawing_name, read_panel,
};
use super::resolver::SettingsResolver;
use super::user::{self, WebRole, WebUsers, WrittenUser};
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{Address, Bit, BitSpace, NumberRange, NumberRanges, Space};
use rungd_language::resolve::scope::{NamedThing, Scope};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, Help, advise, pair, possible};
use rungd_language::source::key::key;
use rungd_language::source::nearest::KnownNames;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::renaming;
use rungd_language::source::slot::Slot;
use rungd_language::source::span::Span;
use rungd_language::source::value_kind::Millis;
use rungd_runtime::exchange::BATCH_WRITES_MAX;
use rungd_runtime::hold_step::HOLD_PERIOD_MAX;

/// `[web]` and `[[panel]]` as written.
#[derive(Clone, Debug, Default)]
pub struct WrittenWeb {
    /// `[web] write`.
    write: Vec<Text>,
    /// `[web] write-service`.
    write_service: Vec<Text>,
    /// `[web] sign-out`, ms.
    sign_out_ms: Option<u32>,
    /// `[[user]]`, in file order.
    users: Vec<WrittenUser>,
    /// `[[panel]]`, in file order.
    panels: Vec<WrittenPanel>,
}

/// The operands that `rungd web` may write, and its panels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WebSettings {
    /// The operands that users may write.
    pub write: Vec<WebOperand>,
    /// The role that a user needs to write each of them.
    needs: HashMap<Address, WebRole>,
    /// The bits that a user may hold ON: those of `hold` in a panel.
    pub hold: Vec<Address>,
    /// The operands that are written with a reason alone: those of parts with `reason`.
    reasons: HashSet<Address>,
    /// The roles of users.
    pub users: WebUsers,
    /// A user who does nothing for this time may only look until the next sign-in, ms.
    pub sign_out_ms: Option<u32>,
    /// The panels, in file order.
    pub panels: Vec<Panel>,
}

/// An operand that users may write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WebOperand {
    /// Its name in the file.
    pub name: String,
    /// Its address.
    pub address: Address,
    /// The role that a user needs.
    pub role: WebRole,
}

impl WebSettings {
    /// The role that a user needs to write an operand; `None`: nobody may.
    pub fn needed(&self, address: Address) -> Option<WebRole> {
        self.needs.get(&address).copied()
    }

    /// Whether an operand is written with a reason alone.
    pub fn wants_reason(&self, address: Address) -> bool {
        self.reasons.contains(&address)
    }
}

/// What the parts of panels depend on beside names.
pub(super) struct PanelTerms<'a> {
    /// The ranges that survive a restart.
    pub retained: &'a NumberRanges<Space>,
    /// The scan period.
    pub period: ScanPeriod,
    /// The groups of alarms.
    pub groups: HashSet<&'a str>,
}

/// The most bits and words of a `recipe`: as many as one change writes.
const ELEMENTS_MAX: usize = BATCH_WRITES_MAX;

/// Reads `[web]` and all `[[panel]]`.
pub(super) fn read_in(root: &mut Table<'_>) -> WrittenWeb {
    let mut web = WrittenWeb::default();
    let explained = key("web", "What people at `rungd web` may do.");
    if let Some(mut table) = root.table(explained, "`[web]`") {
        web.write = table.texts(
            key("write", "The bits and words that a user who operates may write.")
                .holds(Slot::Operand),
        );
        let service = "The bits and words that only a user with the role `service` may write.";
        web.write_service = table.texts(key("write-service", service).holds(Slot::Operand));
        let sign_out = "Who does nothing for this time may only look until the next sign-in; never \
                        if not given.";
        web.sign_out_ms = table.value_of(key("sign-out", sign_out), &Millis::some("5m"));
        table.finish();
    }
    let explained = key("panel", "A page of `rungd web` for people at the machine.");
    web.panels = root.tables(explained, "a panel").into_iter().map(read_panel).collect();
    web.users = user::read_in(root);
    web
}

/// Makes the settings from the keys, with a finding for each wrong value.
pub(super) fn resolve(
    written: &WrittenWeb,
    terms: &PanelTerms<'_>,
    resolver: &mut SettingsResolver<'_>,
) -> WebSettings {
    let (write, needs) = rights(written, resolver);
    resolver.findings.extend(nobody_serves(written));
    let users = user::resolve(&written.users, &mut resolver.findings);
    let sign_out_ms = written.sign_out_ms;
    let mut web = WebSettings { write, users, sign_out_ms, ..WebSettings::default() };
    let progress = resolver.progress;
    let (hold, reasons) = (Vec::new(), HashSet::new());
    let mut parts = PartResolver { terms, needs, hold, reasons, resolver };
    let mut firsts: HashMap<&str, Span> = HashMap::new();
    for panel in progress.during(&written.panels) {
        let Some(name) = &panel.name else { continue };
        if let Some(first) = firsts.get(name.text.as_str()) {
            let message = format!("a second panel `{}`", name.text);
            let finding = Finding::new(Code::Controller, name.span, message);
            let fix = renaming::another(&name.text, ' ', |name| firsts.contains_key(name));
            parts.resolver.findings.push(finding.related(*first, "the first one").fix(fix));
            continue;
        }
        firsts.insert(&name.text, panel.span);
        let shown = progress.during(&panel.show).filter(|(widget, text)| parts.fits(widget, text));
        let show = shown.map(|(widget, _)| widget.clone()).collect();
        web.panels.push(Panel { name: name.text.clone(), show });
    }
    (web.hold, web.reasons, web.needs) = (parts.hold, parts.reasons, parts.needs);
    web
}

/// The finding for a `write-service` if no user has the role for it.
fn nobody_serves(written: &WrittenWeb) -> Option<Finding> {
    let listed = written.write_service.first()?;
    if written.users.iter().any(WrittenUser::may_serve) {
        return None;
    }
    let message = "nobody may write this: no user has the role `service`";
    let finding = Finding::new(Code::Controller, listed.span, message.to_owned());
    Some(finding.help("give a user this role in a `[[user]]`, or list the operand in `write`"))
}

/// The operands of `[web] write` and `write-service`, and the role that each needs.
fn rights(
    written: &WrittenWeb,
    resolver: &mut SettingsResolver<'_>,
) -> (Vec<WebOperand>, HashMap<Address, WebRole>) {
    let (mut write, mut needs) = (Vec::new(), HashMap::new());
    for (texts, role) in
        [(&written.write, WebRole::Operate), (&written.write_service, WebRole::Service)]
    {
        for text in resolver.progress.during(texts) {
            for (name, address) in resolve_write(text, resolver) {
                if *needs.entry(address).or_insert(role) == role {
                    write.push(WebOperand { name, address, role });
                    continue;
                }
                let message = format!("`{name}` is in `write` too: who operates may write it");
                let finding = Finding::new(Code::Controller, text.span, message);
                resolver.findings.push(finding.help("list it once").or_omit());
                break;
            }
        }
    }
    (write, needs)
}

/// The operands that a text of `[web] write` means, each with its name: a record and an array as
/// their elements.
fn resolve_write(text: &Text, resolver: &mut SettingsResolver<'_>) -> Vec<(String, Address)> {
    let many = elements(text, resolver.scope);
    if many.as_ref().is_some_and(|many| many.len() > ELEMENTS_MAX) {
        let help = "list the elements, the records or the fields that pages need";
        too_many(text, help, resolver);
        return Vec::new();
    }
    let one = || Some(vec![(text.text.trim().to_owned(), operand(text, resolver)?)]);
    let mut named = many.or_else(one).unwrap_or_default();
    if let Some(at) = named.iter().position(|(_, address)| !may_write(*address)) {
        let message = format!("`{}` cannot be written from outside", named[at].0);
        let finding = Finding::new(Code::Controller, text.span, message);
        let help = "list inputs, data, relays, presets and accumulators: see docs/operator.md";
        resolver.findings.push(finding.help(help).or_omit());
        named.truncate(at);
    }
    named
}

/// Judges the parts of panels, with a finding for each that cannot be shown.
struct PartResolver<'a, 'r, 's> {
    terms: &'a PanelTerms<'a>,
    /// What `[web] write` and `write-service` list.
    needs: HashMap<Address, WebRole>,
    /// The bits of `hold` so far.
    hold: Vec<Address>,
    /// The operands of parts with `reason` so far.
    reasons: HashSet<Address>,
    resolver: &'r mut SettingsResolver<'s>,
}

impl PartResolver<'_, '_, '_> {
    /// Whether a part can be shown.
    fn fits(&mut self, widget: &Widget, text: &Text) -> bool {
        match widget.kind {
            WidgetKind::Alarms => is_group(text, self.terms, self.resolver),
            WidgetKind::Mimic => is_drawing(text, self.resolver),
            WidgetKind::Recipe => self.is_recipe_part(widget, text),
            WidgetKind::Lamp | WidgetKind::Button | WidgetKind::Hold => {
                self.is_bit_part(widget, text)
            }
            WidgetKind::Value => self.is_value(widget, text),
            WidgetKind::Trend => operand(text, self.resolver).is_some(),
            WidgetKind::Bar => self.is_bar(widget, text),
        }
    }

    /// Whether a lamp or a button has a bit, and a button one that it may write.
    fn is_bit_part(&mut self, widget: &Widget, text: &Text) -> bool {
        let Some(address) = operand(text, self.resolver) else { return false };
        let name = &widget.operand;
        if !matches!(address, Address::Bit(_)) {
            let value = pair(format!("value = \"{name}\"")).possible();
            let help = Help::from("write a `value` or a `bar`").with(value);
            return self.refuse(text, format!("`{name}` is not a bit"), help);
        }
        let presses = matches!(widget.kind, WidgetKind::Button | WidgetKind::Hold);
        if presses && !self.needs.contains_key(&address) {
            let message = format!("nobody may write `{name}`: this button would do nothing");
            let list = FixEdit::Under { table: "web", pair: format!("write = [\"{name}\"]") };
            let help = Help::from(format!("list it: `[web]` with `write = [\"{name}\"]`"));
            return self.refuse(text, message, help.with(possible(list)));
        }
        if widget.kind == WidgetKind::Hold {
            if !may_hold(address, text, self.terms, self.resolver) {
                return false;
            }
            self.hold.push(address);
        }
        self.reasons.extend(widget.reason.then_some(address));
        true
    }

    /// Whether a value has an operand.
    fn is_value(&mut self, widget: &Widget, text: &Text) -> bool {
        let Some(address) = operand(text, self.resolver) else { return false };
        self.reasons.extend(widget.reason.then_some(address));
        true
    }

    /// Whether a recipe has a record or an array.
    fn is_recipe_part(&mut self, widget: &Widget, text: &Text) -> bool {
        if !is_recipe(text, self.resolver) {
            return false;
        }
        if widget.reason {
            let all = elements(text, self.resolver.scope).unwrap_or_default();
            self.reasons.extend(all.into_iter().map(|(_, address)| address));
        }
        true
    }

    /// Whether a bar has a word.
    fn is_bar(&mut self, widget: &Widget, text: &Text) -> bool {
        let Some(address) = operand(text, self.resolver) else { return false };
        if !matches!(address, Address::Bit(_)) {
            return true;
        }
        let name = &widget.operand;
        let lamp = pair(format!("lamp = \"{name}\"")).possible();
        let lamp = lamp.after(FixEdit::Remove("min")).after(FixEdit::Remove("max"));
        self.refuse(text, format!("`{name}` is a bit"), Help::from("write a `lamp`").with(lamp))
    }

    /// Adds a finding about a part.
    fn refuse(&mut self, text: &Text, message: String, help: Help) -> bool {
        let finding = Finding::new(Code::Controller, text.span, message);
        self.resolver.findings.push(finding.help(help));
        false
    }
}

/// Whether an address may be written; an operator may write the same addresses
/// (`operator::operand`).
fn may_write(address: Address) -> bool {
    match address {
        Address::Bit(Bit::Space(BitSpace::X, _)) => true,
        Address::Bit(bit) => bit.writable_from_outside(),
        Address::Word(word) => word.writable(),
        Address::Structure(_) => false,
    }
}

/// The bit or word of a name.
fn operand(text: &Text, resolver: &mut SettingsResolver<'_>) -> Option<Address> {
    let name = text.text.trim();
    let finding = match resolver.address(name, text.span)? {
        Ok(Address::Structure(_)) => {
            let message = format!("`{name}` is a structure");
            let finding = Finding::new(Code::Controller, text.span, message);
            finding.help(advise("name a member, as `{}`", [possible(format!("{name}.Acc"))]))
        }
        Ok(address @ (Address::Bit(_) | Address::Word(_))) => return Some(address),
        Err(message) => Finding::new(Code::Controller, text.span, message),
    };
    resolver.findings.push(finding);
    None
}

/// The bits and words of a record, of an array of records or of an array, each with its name, at
/// most one more than [`ELEMENTS_MAX`]; `None` for any other name.
fn elements(text: &Text, scope: &Scope) -> Option<Vec<(String, Address)>> {
    let name = text.text.trim();
    match scope.look_up(name).ok()?.thing {
        NamedThing::Record(place) => {
            let fields = scope.fields(place).take(ELEMENTS_MAX + 1);
            let named = fields.filter_map(|field| Some((scope.address(&field).ok()?, field)));
            Some(named.map(|(address, field)| (field, address)).collect())
        }
        NamedThing::Array(array) => {
            let addresses = array.addresses().take(ELEMENTS_MAX + 1).enumerate();
            Some(addresses.map(|(at, address)| (format!("{name}[{at}]"), address)).collect())
        }
        NamedThing::Address(_)
        | NamedThing::Constant(..)
        | NamedThing::Real(_)
        | NamedThing::Block(_)
        | NamedThing::Device(_)
        | NamedThing::Element(_) => None,
    }
}

/// Adds a finding about a record or an array of more than [`ELEMENTS_MAX`] bits and words.
fn too_many(text: &Text, help: &'static str, resolver: &mut SettingsResolver<'_>) {
    let name = text.text.trim();
    let message = format!("`{name}` has more than {ELEMENTS_MAX} values");
    resolver.findings.push(Finding::new(Code::Controller, text.span, message).help(help));
}

/// Whether a text names what a table can show: at most [`ELEMENTS_MAX`] bits and words.
fn is_recipe(text: &Text, resolver: &mut SettingsResolver<'_>) -> bool {
    let name = text.text.trim();
    match elements(text, resolver.scope) {
        Some(elements) if elements.len() > ELEMENTS_MAX => {
            let help = "no one change can write so many: show a shorter array";
            too_many(text, help, resolver);
            return false;
        }
        Some(_) => return true,
        // An unknown name has its own finding.
        None if resolver.address(name, text.span).is_none() => return false,
        None => {}
    }
    let message = format!("`{name}` is no record and no array");
    let help = "name a tag whose `type` is a record, or an array; one operand is a `value`";
    resolver.findings.push(Finding::new(Code::Controller, text.span, message).help(help));
    false
}

/// Whether a text can be the name of a drawing: a file without a folder.
fn is_drawing(text: &Text, resolver: &mut SettingsResolver<'_>) -> bool {
    let name = text.text.trim();
    let is_file = is_drawing_name(name);
    if !is_file {
        let message = format!("`{name}` is not the name of an SVG file");
        let finding = Finding::new(Code::Controller, text.span, message);
        let help = "name an SVG file in the folder of rungd web --mimics, without a path, by \
                    letters, digits, spaces, dashes, underscores and dots";
        resolver.findings.push(finding.help(help));
    }
    is_file
}

/// Whether a text is a group of alarms, or stands for all.
fn is_group(text: &Text, terms: &PanelTerms<'_>, resolver: &mut SettingsResolver<'_>) -> bool {
    let name = text.text.trim();
    if name == ALL_ALARMS || terms.groups.contains(name) {
        return true;
    }
    let message = format!("no alarm has the group `{name}`");
    let mut groups: Vec<&str> = terms.groups.iter().copied().collect();
    groups.sort_unstable();
    let help = "name the `group` of a tag with an `alarm`, or write `*` for all alarms";
    let finding = Finding::new(Code::Controller, text.span, message).help(help);
    resolver.findings.push(finding.near(name, &KnownNames::new(groups)));
    false
}

/// Whether a bit can be held: it goes OFF at the end of a hold, whatever happens.
fn may_hold(
    address: Address,
    text: &Text,
    terms: &PanelTerms<'_>,
    resolver: &mut SettingsResolver<'_>,
) -> bool {
    let name = text.text.trim();
    let number = Space::of(address.without_bit());
    let number = number.map(|(kind, n)| NumberRange { kind, first: n, last: n });
    let is_retained = number.is_some_and(|number| terms.retained.first_in(number).is_some());
    let (message, help) = if matches!(address, Address::Bit(Bit::Space(BitSpace::X, _))) {
        (
            format!("`{name}` is an input, which a device moves"),
            "hold a bit C, and read it in the ladder",
        )
    } else if is_retained {
        (
            format!("`{name}` is retained: after a power cut it would be ON without its button"),
            "take it out of `[retain]`, or hold a bit that is not retained",
        )
    } else if u128::from(terms.period.ns()) > HOLD_PERIOD_MAX.as_nanos() {
        (
            format!("`{name}` is held, and a scan comes every {}", terms.period.words()),
            "write `scan.period = \"100ms\"` or less: a hold ends within 500 ms",
        )
    } else {
        return true;
    };
    let finding = Finding::new(Code::Controller, text.span, message);
    resolver.findings.push(finding.help(help));
    false
}
