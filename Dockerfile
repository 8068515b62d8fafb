# Runs the demo on the simulated arm; the pages are in ./demo then:
#   docker build -t wam-ident . && mkdir -p demo && docker run --rm --user $(id -u) -v "$PWD/demo:/demo" wam-ident
FROM python:3.13-slim-bookworm
RUN apt-get update && apt-get install -y --no-install-recommends libgomp1 && rm -rf /var/lib/apt/lists/*
RUN useradd --create-home arm && install -d -o arm /demo
WORKDIR /home/arm/wam-ident
COPY --chown=arm . .
RUN pip install --no-cache-dir --constraint constraints.txt ".[can]"
USER arm
ENV OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_CACHE_DIR=/tmp/numba
VOLUME /demo
CMD ["scripts/flow", "/demo"]
