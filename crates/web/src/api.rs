//! The questions of a page.
//!
//! They are answered from the data of `follow`. A question that executes scans again is answered on
//! a thread for blocking work. `changes` has what a signed-in user may change.

use std::path::{Path, PathBuf};
use std::sync::Arc;
#[cfg(feature = "prove")]
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use hyper::StatusCode;
use serde_json::{Value, json};

use super::panels;
use super::query::Query;
use super::recipe::recipe;
use super::reply::{WebFailure, WebResult, bad, json_answer};
use super::rights::{SessionRights, settings};
use super::routes::PageQuestion;
#[cfg(feature = "prove")]
use super::search::search;
use super::sessions::WebSession;
use super::site::WebSite;
use super::stream::{ProgramWindow, SentState, name_of, tag_value, texts_by_value};
use super::trend_store::{TrendQuestion, TrendStore};
use super::views::{asked, of, operand, viewed};
use rungd_client::live::{LiveEvent, LiveProgram, LiveTag, LiveView, TrendGap, TrendPoint};
use rungd_client::operator::client;
use rungd_client::operator::protocol::Request;
use rungd_config::controller::web::WebOperand;
use rungd_engine::isa::Address;
use rungd_lab::draw::ladder::{BlockPicture, RungPicture, StagePicture};
use rungd_lab::draw::live_svg;
#[cfg(feature = "prove")]
use rungd_prove::how::how_to_change;

/// The most rungs, and the most tags, of an answer.
const RUNGS_MAX: usize = 60;
const TAGS_MAX: usize = 500;
/// The longest wait for the controller's list of its changes of program.
const DEPLOYS_WAIT: Duration = Duration::from_secs(5);

/// The questions that need the last minute.
const PAST: [PageQuestion; 6] = [
    PageQuestion::Events,
    PageQuestion::Hold,
    PageQuestion::Scan,
    PageQuestion::Why,
    PageQuestion::How,
    PageQuestion::Trend,
];

/// Answers a question.
pub(super) async fn question(
    site: &Arc<WebSite>,
    question: PageQuestion,
    query: &Query,
    session: &WebSession,
) -> WebResult {
    if question == PageQuestion::Status {
        let seen = site.follow.now().await;
        let present = seen.view.as_ref().ok().and_then(|view| view.present.as_deref());
        let now = present.map(|outputs| json!({ "mode": outputs.mode, "reason": outputs.reason }));
        let error = seen.view.as_ref().err();
        let status = seen.status.as_deref();
        return Ok(json_answer(&json!({ "status": status, "now": now, "error": error })));
    }
    if question == PageQuestion::Recipe {
        return recipe(site, query).await;
    }
    let view = match query.number("hold") {
        Some(hold) => site.held(hold).ok_or_else(|| {
            let why = "the scans that were held are gone: pause again";
            WebFailure(StatusCode::GONE, why.to_owned())
        })?,
        None if PAST.contains(&question) => of(site.follow.with_minute().await)?,
        None => viewed(site).await?,
    };
    let query = query.clone();
    match question {
        PageQuestion::Hold => {
            let scans = view.scans().ok_or_else(|| bad("no scan is recorded yet"))?;
            let scans = json!([scans.start(), scans.end()]);
            Ok(json_answer(&json!({ "hold": site.hold(view), "scans": scans })))
        }
        PageQuestion::Session => Ok(json_answer(&of_session(session, &view))),
        PageQuestion::Ladder => Ok(json_answer(&ladder(&view.program))),
        PageQuestion::Mimic => {
            let folder = site.mimics.clone();
            asked(site, move || panels::drawing(folder.as_deref(), &view.program, &query)).await
        }
        PageQuestion::Panels => Ok(json_answer(&panels::panels(&view.program))),
        PageQuestion::Tags => Ok(json_answer(&tags(&view.program, query.get("find")))),
        PageQuestion::Events => asked(site, move || Ok(happened(&view))).await,
        PageQuestion::Rungs => asked(site, move || rungs(&view, &query)).await,
        PageQuestion::Scan => asked(site, move || scan(&view, &query)).await,
        PageQuestion::Why => asked(site, move || why(&view, &query)).await,
        #[cfg(feature = "prove")]
        PageQuestion::How => search(site, move |given_up| how(&view, &query, given_up)).await,
        PageQuestion::Trend if query.number("minutes").is_some_and(|minutes| minutes > 1) => {
            let (trends, socket) = (site.trends.clone(), site.follow.socket());
            asked(site, move || over_hours(&trends, &view, &query, socket)).await
        }
        PageQuestion::Trend => asked(site, move || trend(&view, &query)).await,
        #[cfg(not(feature = "prove"))]
        PageQuestion::How => {
            Err(WebFailure(StatusCode::NOT_FOUND, "there is no such page".to_owned()))
        }
        PageQuestion::Deploys => {
            let socket = site.follow.socket();
            asked(site, move || deploys(socket.as_deref())).await
        }
        // Answered before, and by `stream`.
        PageQuestion::Status | PageQuestion::Recipe | PageQuestion::Stream => {
            Err(WebFailure(StatusCode::NOT_FOUND, "there is no such page".to_owned()))
        }
    }
}

/// What the page offers to its user: the operands that this role may write.
fn of_session(session: &WebSession, view: &LiveView) -> Value {
    let user = session.user.as_ref().map(|user| &user.name);
    let settings = settings(&view.program);
    let rights = SessionRights::of(session, settings, Instant::now());
    let write: Vec<&WebOperand> = settings
        .iter()
        .flat_map(|web| &web.write)
        .filter(|operand| user.is_some() && operand.role <= rights.role)
        .collect();
    let named = |fits: &dyn Fn(&WebOperand) -> bool| -> Vec<&str> {
        let fitting = write.iter().filter(|operand| fits(operand));
        fitting.map(|operand| operand.name.as_str()).collect()
    };
    let wants =
        |operand: &WebOperand| settings.is_some_and(|web| web.wants_reason(operand.address));
    json!({
        "user": user,
        "role": rights.role.word(),
        "signed_out": rights.is_signed_out,
        "sign_out_ms": settings.and_then(|web| web.sign_out_ms),
        "csrf": session.csrf,
        "write": named(&|_| true),
        "bits": named(&|operand| matches!(operand.address, Address::Bit(_))),
        "reasons": named(&wants),
        "shelves_critical": view.program.controller.as_ref()
            .is_some_and(|controller| controller.alarms.shelves_critical),
        "version": env!("CARGO_PKG_VERSION"),
        "how": cfg!(feature = "prove"),
    })
}

/// The blocks and Stages, each with the number of rows of its rungs, from which a page computes
/// their heights.
fn ladder(program: &LiveProgram) -> Value {
    let rows = |rungs: &[RungPicture]| -> Vec<usize> {
        rungs.iter().map(|rung| rung.grid.rows.max(1)).collect()
    };
    let block = |block: &BlockPicture| {
        let stage = |stage: &StagePicture| {
            let rows = rows(&stage.rungs);
            json!({ "name": stage.name, "doc": stage.doc, "rows": rows })
        };
        json!({
            "name": block.name,
            "kind": block.kind,
            "doc": block.doc,
            "rows": rows(&block.rungs),
            "stages": block.stages.iter().map(stage).collect::<Vec<_>>(),
            "ways": block.ways(),
        })
    };
    json!({
        "name": program.picture.name,
        "doc": program.picture.doc,
        "program": name_of(program),
        "blocks": program.picture.blocks.iter().map(block).collect::<Vec<_>>(),
    })
}

/// The tags whose name, address or `doc` contains a text.
fn tags(program: &LiveProgram, find: Option<&str>) -> Value {
    let find = find.unwrap_or_default().to_lowercase();
    // `pump 2` finds pump2, and `pump2` finds pump_2.
    let joined = |text: &str| text.replace([' ', '_'], "");
    let find_joined = joined(&find);
    let has = |text: &str| {
        let text = text.to_lowercase();
        text.contains(&find) || joined(&text).contains(&find_joined)
    };
    let mut all = program
        .tags()
        .filter(|tag| has(tag.name) || has(&tag.address) || tag.doc.is_some_and(&has));
    let tag = |tag: LiveTag<'_>| {
        json!({
            "name": tag.name,
            "address": tag.address,
            "doc": tag.doc,
            "unit": tag.unit,
            "texts": tag.texts.map(texts_by_value),
            "members": tag.members,
        })
    };
    let shown: Vec<Value> = all.by_ref().take(TAGS_MAX).map(tag).collect();
    json!({ "tags": shown, "more": all.count() })
}

/// The drawings of some rungs.
fn rungs(view: &LiveView, query: &Query) -> Result<Value, WebFailure> {
    let element = query.get("element").unwrap_or_default();
    let all = view.program.rungs(element);
    let all = all.ok_or_else(|| bad(format!("there is no block or Stage `{element}`")))?;
    let from = query.number("from").unwrap_or(1).max(1) as usize;
    let to = query.number("to").unwrap_or(0) as usize;
    let count = to.saturating_add(1).saturating_sub(from).min(RUNGS_MAX);
    let rung = |rung: &RungPicture| {
        let title = rung.title();
        let (file, line) = &rung.place;
        let of_use = rung.of_use.as_ref().map(|template_use| &template_use.name);
        json!({
            "number": rung.number,
            "title": title,
            "doc": rung.doc,
            "file": file,
            "line": line,
            "use": of_use,
            "svg": live_svg::drawing(&rung.grid, &title, 0),
            "words": view.program.words(element, rung.number),
            "outputs": view.program.outputs(element, rung.number),
        })
    };
    let rungs: Vec<Value> = all.iter().skip(from - 1).take(count).map(rung).collect();
    Ok(json!({ "program": name_of(&view.program), "element": element, "rungs": rungs }))
}

/// The power and the values of a scan of the last minute.
fn scan(view: &LiveView, query: &Query) -> Result<Value, WebFailure> {
    let number = query.number("scan").ok_or_else(|| bad("name a scan"))?;
    let power = view.at(number).map_err(|why| WebFailure(StatusCode::GONE, why))?;
    Ok(SentState::default().news(view, &power, &ProgramWindow::of(query)))
}

/// The events of the last minute, the newest first.
fn happened(view: &LiveView) -> Value {
    let event = |live_event: LiveEvent| {
        json!({
            "time_ms": live_event.unix_ns / 1_000_000,
            "scan": live_event.scan,
            "text": live_event.text,
            "alarm": live_event.is_alarm,
            "operand": live_event.operand,
        })
    };
    json!({ "events": view.events().into_iter().rev().map(event).collect::<Vec<_>>() })
}

/// The last changes of the program, of the controller that the pages show.
fn deploys(socket: Option<&Path>) -> Result<Value, WebFailure> {
    let gone = |why: String| WebFailure(StatusCode::BAD_GATEWAY, why);
    let socket = socket.ok_or_else(|| gone("no controller has answered yet".to_owned()))?;
    client::ask_within(socket, &Request::Deploys {}, DEPLOYS_WAIT)
        .map_err(|failure| gone(failure.to_string()))
}

fn why(view: &LiveView, query: &Query) -> Result<Value, WebFailure> {
    let answer = view.why(operand(query)?, query.number("scan")).map_err(bad)?;
    let text = format!("{}{}", answer.text(), answer.hints());
    Ok(json!({ "text": text, "answer": answer.json() }))
}

#[cfg(feature = "prove")]
fn how(view: &LiveView, query: &Query, given_up: Arc<AtomicBool>) -> Result<Value, WebFailure> {
    let moment = view.moment(query.number("scan")).map_err(bad)?;
    let answer = how_to_change(moment, operand(query)?, given_up).map_err(bad)?;
    Ok(json!({ "text": answer.text(), "answer": answer.json() }))
}

/// A trend over more than a minute, as far as it is known.
fn over_hours(
    trends: &TrendStore,
    view: &LiveView,
    query: &Query,
    socket: Option<PathBuf>,
) -> Result<Value, WebFailure> {
    let operand = operand(query)?.to_owned();
    let newest = view.newest_piece(&operand).map_err(bad)?;
    let minutes = query.number("minutes").unwrap_or(1);
    let span_ns = i64::try_from(minutes).unwrap_or(i64::MAX).saturating_mul(60_000_000_000);
    let mut answer = trends.answer(TrendQuestion { operand, span_ns, socket }, &newest);
    answer["minutes"] = json!(minutes);
    Ok(answer)
}

fn trend(view: &LiveView, query: &Query) -> Result<Value, WebFailure> {
    let operand = operand(query)?;
    let found = view.trend(operand).map_err(bad)?;
    let cell = view.program.subject.cell(operand).map_err(bad)?;
    let point = |trend_point: &TrendPoint| {
        let value = trend_point.value.map(|content| tag_value(view.tag_value(cell, content)));
        json!([trend_point.unix_ns / 1_000_000, trend_point.scan, value])
    };
    let span = found.span_ns.map(|(first, last)| [first / 1_000_000, last / 1_000_000]);
    let points: Vec<Value> = found.points.iter().map(point).collect();
    let gap = |gap: &TrendGap| {
        json!([gap.from_ns / 1_000_000, gap.to_ns.map(|ns| ns / 1_000_000), gap.mode.name()])
    };
    let gaps: Vec<Value> = found.gaps.iter().map(gap).collect();
    Ok(json!({ "operand": operand, "span_ms": span, "points": points, "gaps": gaps }))
}
