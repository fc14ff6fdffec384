# An image with rungd: one static program, licences, a user, and a first controller with a simulated
# device. The image has nothing else, not even a shell.
#
#   docker build -t rungd .
#   docker run --rm rungd                                            # the first controller
#   docker run --rm -v "$PWD/plant:/etc/rungd:ro" rungd              # plant/controller.toml
#   docker exec CONTAINER rungd status                               # its state
#
# docs/install.md describes real-time priority. tests/container.sh builds and tests it.
FROM rust:1-slim-trixie AS build
WORKDIR /src
COPY Cargo.toml Cargo.lock LICENSE-MIT LICENSE-APACHE ./
COPY benches ./benches
COPY config ./config
COPY crates ./crates
COPY docs ./docs
COPY packaging/third-party.sh ./packaging/
COPY src ./src
COPY tests ./tests
# Links glibc statically. The target is named, because build scripts and macros must stay dynamic.
RUN host="$(rustc -vV | sed -n 's/^host: //p')" \
    && RUSTFLAGS="-C target-feature=+crt-static -C strip=symbols" \
        cargo build --profile dist --locked --bin rungd --target "$host" \
    && mkdir -p /image/usr/bin /image/usr/share/doc/rungd /image/etc/rungd/programs \
        /image/run/rungd /image/var/lib/rungd \
    && cp LICENSE-MIT LICENSE-APACHE /image/usr/share/doc/rungd/ \
    && packaging/third-party.sh >/image/usr/share/doc/rungd/third-party-licences.txt \
    && cp "target/$host/dist/rungd" /image/usr/bin/ \
    && cp config/first/controller.toml /image/etc/rungd/ \
    && cp config/first/programs/main.toml /image/etc/rungd/programs/ \
    && echo 'rungd:x:6553:6553:rungd soft-PLC:/var/lib/rungd:/usr/sbin/nologin' >/image/etc/passwd \
    && printf 'rungd:x:6553:\nrungd-view:x:6554:rungd\n' >/image/etc/group \
    && chown -R 6553:6553 /image/run/rungd /image/var/lib/rungd

FROM scratch
COPY --from=build /image /
# Without a group, so that the engine gives the process the groups of /etc/group too.
USER 6553
WORKDIR /var/lib/rungd
# RUNTIME_DIRECTORY and RUNGD_SOCKET: the folder of the operator's socket, and the socket.
# RUNGD_VIEW_GROUP: the group of the view socket, which refuses every change.
# RUNGD_RECORD: the folder of the scan log; mount a volume there to keep the log.
ENV PATH=/usr/bin RUNTIME_DIRECTORY=/run/rungd RUNGD_SOCKET=/run/rungd/rungd.sock \
    RUNGD_VIEW_GROUP=rungd-view \
    RUNGD_RECORD=/var/lib/rungd/record
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s --retries=3 CMD ["rungd", "status"]
ENTRYPOINT ["rungd"]
CMD ["run", "/etc/rungd/controller.toml"]
