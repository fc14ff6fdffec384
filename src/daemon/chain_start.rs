//! The start of the audit trail's chain: the file that the environment names, and the first line
//! about it.
//!
//! Called by `log`, before the log takes lines and once after. A chain that cannot go on never
//! keeps a controller from running: the log says so.

use std::path::PathBuf;

use super::log_chain::{ChainBegin, ChainedForm, LogChain};
use rungd_runtime::say::say;

/// The environment variable that names the file of the audit trail's chain.
const CHAIN_VARIABLE: &str = "RUNGD_LOG_CHAIN";

/// What the log says about the chain of the audit trail at its start.
pub(super) struct ChainNews {
    file: String,
    begin: Result<ChainBegin, String>,
}

/// The chain that the environment asks for, for lines of this form, and what to say about it.
pub(super) fn chain_of(form: Option<ChainedForm>) -> (Option<LogChain>, Option<ChainNews>) {
    let file = std::env::var_os(CHAIN_VARIABLE);
    let Some(path) = file.filter(|path| !path.is_empty()).map(PathBuf::from) else {
        return (None, None);
    };
    let file = path.display().to_string();
    let opened = match form {
        Some(_) => LogChain::open(&path).map_err(|error| format!("{file}: {error}")),
        None => Err("a terminal shows no links: send the log to a file or the journal".to_owned()),
    };
    let (chain, begin) = match opened {
        Ok((chain, begin)) => (Some(chain), Ok(begin)),
        Err(why) => (None, Err(why)),
    };
    (chain, Some(ChainNews { file, begin }))
}

impl ChainNews {
    /// Says it, once the log takes lines.
    pub fn tell(self) {
        let ChainNews { file, begin } = self;
        match begin {
            Ok(ChainBegin::New) => {
                say!(LOG_CHAIN, file, "the audit trail is chained: a chain begins");
            }
            Ok(ChainBegin::Behind(link)) => say!(
                LOG_CHAIN,
                file,
                behind = %link,
                "the audit trail is chained: it goes on behind link {}", link.number
            ),
            Ok(ChainBegin::Damaged) => say!(
                LOG_CHAIN at Warn,
                file,
                "the audit trail is chained: a new chain begins, because the file has no link"
            ),
            Err(why) => say!(LOG_CHAIN at Error, file, "the audit trail is not chained: {why}"),
        }
    }
}
