# docker build -t pairsim . ; docker run --rm -v "$PWD:/work" --user "$(id -u):$(id -g)" pairsim run case.yaml
FROM python:3.13-slim-bookworm AS build
WORKDIR /source
COPY pyproject.toml README.md LICENSE MANIFEST.in ./
COPY configs configs
COPY pairsim pairsim
RUN python -m venv /opt/pairsim \
    && /opt/pairsim/bin/python -m pip install --no-cache-dir ".[fenicsx]"

FROM python:3.13-slim-bookworm
# A C compiler for the weak forms, and the libraries that the gmsh wheel links to.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends \
        gcc libc6-dev libgl1 libglu1-mesa libgomp1 libxcursor1 libxft2 libxinerama1 libxrender1 \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /opt/pairsim /opt/pairsim
ENV PATH=/opt/pairsim/bin:$PATH \
    MPLCONFIGDIR=/cache/matplotlib \
    OMP_NUM_THREADS=1 \
    XDG_CACHE_HOME=/cache
# Compiled forms go into /cache, which is everybody's, since the user of `docker run --user` has no home.
RUN useradd --uid 1000 --create-home pairsim \
    && install --directory --mode=1777 /cache /work
USER 1000
WORKDIR /work
ENTRYPOINT ["pairsim"]
CMD ["--help"]
