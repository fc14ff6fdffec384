//! Who may connect: the users of the file that `rungd web passwd` writes, or, at a loopback address
//! without such a file, everybody on this machine.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use async_trait::async_trait;
use opcua::server::ServerEndpoint;
use opcua::server::authenticator::{
    AuthManager, Password, UserToken, user_pass_security_policy_id, user_pass_security_policy_uri,
};
use opcua::types::{Error, StatusCode, UAString, UserTokenPolicy, UserTokenType};
use rungd_web::{PasswordTries, UserDirectory};

use crate::journal::{ClientLine, ServerLines};

/// The wait after a wrong password. Each leaves a session for a minute in the library: a client
/// that tries again and again takes 30 of the 50.
const WRONG_WAIT: Duration = Duration::from_secs(2);

/// The users of a server.
pub struct ServerUsers {
    /// The file; `None`: nobody has to sign in.
    file: Option<Arc<UserDirectory>>,
    /// One password at a time: each takes much memory, and those that wait count the tries before.
    turn: tokio::sync::Mutex<PasswordTries>,
    lines: ServerLines,
}

impl ServerUsers {
    /// The users of a file; without one, everybody.
    pub fn new(file: Option<UserDirectory>, lines: ServerLines) -> ServerUsers {
        ServerUsers { file: file.map(Arc::new), turn: tokio::sync::Mutex::default(), lines }
    }

    /// Judges a password.
    ///
    /// # Errors
    /// It is wrong, too many were, or the file cannot be read: why.
    async fn judge(&self, name: &str, password: &str) -> Result<(), &'static str> {
        let Some(file) = self.file.clone() else { return Err("nobody signs in here") };
        let (tried, password) = (name.to_owned(), password.to_owned());
        let mut tries = self.turn.lock().await;
        tries.may_try(name, Instant::now())?;
        let judged = tokio::task::spawn_blocking(move || file.admits(&tried, &password)).await;
        match judged {
            Ok(Ok(true)) => Ok(()),
            Ok(Ok(false)) => {
                tries.note_wrong(name, Instant::now());
                Err("wrong password")
            }
            Ok(Err(failure)) => {
                self.lines
                    .say(ClientLine::UserDirectory, &format!("nobody can sign in: {failure}"));
                Err("the file of users cannot be read")
            }
            Err(_) => Err("a failure of rungd-opcua"),
        }
    }
}

impl fmt::Debug for ServerUsers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ServerUsers").field("file", &self.file).finish_non_exhaustive()
    }
}

#[async_trait]
impl AuthManager for ServerUsers {
    async fn authenticate_anonymous_token(&self, _: &ServerEndpoint) -> Result<(), Error> {
        match self.file {
            None => Ok(()),
            Some(_) => Err(Error::new(StatusCode::BadIdentityTokenRejected, "sign in")),
        }
    }

    async fn authenticate_username_identity_token(
        &self,
        _: &ServerEndpoint,
        username: &str,
        password: &Password,
    ) -> Result<UserToken, Error> {
        let Err(why) = self.judge(username, password.get()).await else {
            self.lines.say(ClientLine::SignIn, &format!("{username} signs in"));
            return Ok(UserToken(username.to_owned()));
        };
        self.lines.say(ClientLine::WrongPassword, &format!("{username} is refused: {why}"));
        tokio::time::sleep(WRONG_WAIT).await;
        Err(Error::new(StatusCode::BadUserAccessDenied, "wrong name or password"))
    }

    fn user_token_policies(&self, endpoint: &ServerEndpoint) -> Vec<UserTokenPolicy> {
        let (policy_id, token_type) = match self.file {
            None => (UAString::from("anonymous"), UserTokenType::Anonymous),
            Some(_) => (user_pass_security_policy_id(endpoint), UserTokenType::UserName),
        };
        let security_policy_uri = match self.file {
            None => UAString::null(),
            Some(_) => user_pass_security_policy_uri(endpoint),
        };
        vec![UserTokenPolicy {
            policy_id,
            token_type,
            issued_token_type: UAString::null(),
            issuer_endpoint_url: UAString::null(),
            security_policy_uri,
        }]
    }
}
