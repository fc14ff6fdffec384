# Builds rungd and puts it, with its example plants, into a small image.
#
#   docker build -t rungd .
#   docker run --rm rungd                                   # the shipped example
#   docker run --rm -v "$PWD/plant:/etc/rungd:ro" rungd run /etc/rungd/controller.toml
FROM rust:1-slim-trixie AS build
WORKDIR /src
COPY Cargo.toml Cargo.lock ./
COPY src ./src
COPY docs ./docs
COPY benches ./benches
COPY tests ./tests
RUN cargo build --release --locked --bin rungd

FROM debian:trixie-slim
RUN useradd --system --no-create-home rungd
COPY --from=build /src/target/release/rungd /usr/local/bin/rungd
COPY config /etc/rungd
USER rungd
STOPSIGNAL SIGTERM
ENTRYPOINT ["rungd"]
CMD ["run", "/etc/rungd/rungd.toml"]
