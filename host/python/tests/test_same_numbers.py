"""The package answers as the program does, to the bit."""

import shutil

import pytest
import yawrig


def answered(answer):
    """Without how long it took, and without the shell's commands, which are about files: here records are in memory."""
    return {name: value for name, value in answer.items() if name not in ("seconds", "commands")}


@pytest.mark.parametrize("method", ["least-squares", "conventional", "network", "all"])
def test_identify(program, csv, method):
    found = yawrig.identify("r.csv", method=method, from_deg=9, to_deg=1.5)
    said = program.json("identify", "r.csv", "--method", method, "--from-deg", "9", "--to-deg", "1.5")
    assert found.to_dict() == said
    assert found.natural_frequency_rad_s.value == said["records"][0]["estimates"][0]["natural_frequency_rad_s"]["value"]


def test_identify_of_several(program, csv):
    shutil.copy(csv, csv.with_name("again.csv"))
    found = yawrig.identify_each(["r.csv", "again.csv"])
    assert found.to_dict() == program.json("identify", "r.csv", "again.csv")
    assert [record.file for record in found.records] == ["r.csv", "again.csv"]


def test_arrays_give_what_the_file_gives(csv):
    record = yawrig.read("r.csv")
    assert yawrig.identify(record.time_s, record.angle_deg, name="r.csv").to_dict() == yawrig.identify("r.csv").to_dict()


def test_diagnose(program, csv):
    found = yawrig.diagnose("r.csv")
    said = program.json("diagnose", "r.csv")
    assert answered(found.to_dict()) == answered(said)
    assert (found.status, found.effects) == ("explained", ["coulomb_friction"])


def test_diagnose_of_several(program, csv):
    planted = "--natural-frequency 8 --damping 0.008 --seconds 16 --rate-hz 100 --effect coulomb_friction:c=0.15 --seed 2"
    program.json("simulate", *planted.split(), "--out", "b.csv", "--force")
    found = yawrig.diagnose(["r.csv", "b.csv"])
    assert answered(found.to_dict()) == answered(program.json("diagnose", "r.csv", "b.csv"))


def test_compare(program, csv):
    found = yawrig.compare("r.csv", effects=["coulomb_friction", "cubic_damping"])
    said = program.json("compare", "r.csv", "--effect", "coulomb_friction", "--effect", "cubic_damping")
    assert answered(found.to_dict()) == answered(said)
    assert found.to_dict()["commands"] == []


def test_compare_with_a_model(program, csv):
    fitted = yawrig.fit("m.toml", ["r.csv"])
    assert fitted["model"] == "m.toml"
    command = "fit --model n.toml r.csv"
    said = program.json(*command.split())
    assert {**fitted.to_dict(), "model": "n.toml"} == said
    for effects in [[], ["coulomb_friction"]]:
        options = [word for effect in effects for word in ("--effect", effect)]
        said = program.json("compare", "--model", "m.toml", "r.csv", *options)
        assert answered(yawrig.compare("r.csv", model="m.toml", effects=effects).to_dict()) == answered(said)


def test_law(program, csv):
    assert answered(yawrig.law("r.csv").to_dict()) == answered(program.json("law", "r.csv"))


def test_simulate(program, csv):
    made = yawrig.simulate(
        natural_frequency_rad_s=7, damping_ratio=0.006, seconds=16, rate_hz=100, effects=["coulomb_friction:c=0.15"],
        name="r.csv",
    )
    of_file = yawrig.read("r.csv")
    assert (made.record.time_s == of_file.time_s).all() and (made.record.angle_deg == of_file.angle_deg).all()
    command = "simulate --natural-frequency 7 --damping 0.006 --seconds 16 --rate-hz 100 --effect coulomb_friction:c=0.15"
    assert made.to_dict() == program.json(*command.split(), "--out", "r.csv", "--force")


def test_derivatives(program, campaign):
    table = yawrig.Campaign.from_toml("campaign/campaign.toml").derivatives()
    assert table.to_dict() == program.json("derivatives", "campaign/campaign.toml")
    assert len(table.points) == 8


def test_a_simulated_campaign(program, campaign, tmp_path):
    made = yawrig.simulate_campaign(tmp_path / "c", rate_hz=100)
    for file in campaign.parent.iterdir():
        assert (tmp_path / "c" / file.name).read_bytes() == file.read_bytes()
    assert made.path == str(tmp_path / "c" / "campaign.toml") and made.simulated.points[0].truth
