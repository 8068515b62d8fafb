"""`ident fleet` from an object store: a real S3 server, asked over HTTP."""

import urllib.request
from functools import partial

import pandas as pd
import pytest

from ident.fleet.metadata import Rules
from ident.fleet.settings import FleetSettings
from ident.recordings.loading import Reading
from ident.workflows.fleet import fleet as work
from tests.unit.fleet.test_fleet import here
from wamctl.arm.errors import DataError

server = pytest.importorskip("moto.server")
boto3 = pytest.importorskip("boto3")

KEYS = {"AWS_ACCESS_KEY_ID": "a", "AWS_SECRET_ACCESS_KEY": "b", "AWS_DEFAULT_REGION": "us-east-1"}


@pytest.fixture
def store(monkeypatch):
    """A running server's address, with the credentials that it takes."""
    one = server.ThreadedMotoServer("127.0.0.1", port=0, verbose=False)
    one.start()
    host, port = one.get_host_and_port()
    for name, value in {**KEYS, "AWS_ENDPOINT_URL": f"http://{host}:{port}"}.items():
        monkeypatch.setenv(name, value)
    yield f"http://{host}:{port}"
    one.stop()


@pytest.fixture
def run(monkeypatch, tmp_path):
    monkeypatch.setattr(work, "engine", lambda scheduler, workers: (here, 4))
    return partial(
        work.fleet_logs,
        robot=None,
        reading=Reading(),
        rules=Rules(),
        settings=FleetSettings(gap_arms=0, type_rounds=2),
    )


def test_logs_of_an_object_store_say_what_they_say_on_disk(logs, store, run, tmp_path):
    bucket = boto3.resource("s3").create_bucket(Bucket="arms")
    paths = [logs / f"arm{k}" / f"day{d}.mcap" for k in (0, 2) for d in (3, 4)]
    for path in paths:
        bucket.upload_file(path, f"site/{path.parent.name}/{path.name}")
    bucket.put_object(Key="site/arm0/cut.mcap", Body=paths[0].read_bytes()[:300])
    run(["s3://arms/site", "s3://arms/site/arm0/gone.mcap"], tmp_path / "store")
    run(list(map(str, paths)), tmp_path / "disk")
    stored, disk = (
        pd.read_parquet(tmp_path / k / "parameters.parquet").drop(columns="log")
        for k in ("store", "disk")
    )
    pd.testing.assert_frame_equal(stored, disk, check_exact=True)
    told = pd.read_parquet(tmp_path / "store" / "logs.parquet").set_index("log").remarks
    (cut,), (gone,) = told["s3://arms/site/arm0/cut.mcap"], told["s3://arms/site/arm0/gone.mcap"]
    assert cut.startswith("unusable: cut.mcap")
    assert gone.endswith("gone.mcap is not there: check bucket and prefix.")


def test_a_missing_bucket_and_wrong_credentials_are_told_in_a_sentence(store, run, tmp_path):
    with pytest.raises(DataError, match=r"^s3://none/site is not there: check bucket and prefix."):
        run(["s3://none/site"], tmp_path)
    boto3.resource("s3").create_bucket(Bucket="arms").put_object(Key="a.mcap", Body=b"")
    asked = {"Content-Type": "text/plain"}
    closed = urllib.request.Request(f"{store}/moto-api/reset-auth", b"0", asked)
    urllib.request.urlopen(closed).close()
    with pytest.raises(DataError, match=r"^s3://arms cannot be read: the store refuses the cred"):
        run(["s3://arms"], tmp_path)
