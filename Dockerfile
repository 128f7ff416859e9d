# docker build -t talus . && docker run --rm -v "$PWD:/work" talus run scene.toml
# Built from packages.txt as on any Debian 12; the second stage holds the Debian package of `make deb` and
# what it depends on.
FROM debian:bookworm-slim AS build
RUN apt-get update && apt-get install -y --no-install-recommends make
WORKDIR /src
COPY packages.txt Makefile ./
COPY scripts/setup.sh scripts/
RUN make setup
COPY . .
RUN make deb

FROM debian:bookworm-slim
COPY --from=build /src/build/deb/*.deb /tmp/
RUN apt-get update && apt-get install -y --no-install-recommends /tmp/*.deb python3-matplotlib \
    && rm -rf /tmp/*.deb /var/lib/apt/lists/*
WORKDIR /work
ENTRYPOINT ["talus"]
CMD ["--help"]
