//! The program: runs the command line and exits with its code.

fn main() {
    std::process::exit(rungd::cli::run());
}
