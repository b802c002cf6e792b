use super::*;
use yawrig_core::derivatives::at::{At, Value};
use yawrig_link::bench::{Bench, Target};
use yawrig_link::live::session::Follow;
use yawrig_shared::wire::{Flags, Measured, Precise, Refined};

fn measuring() -> Measuring {
    let rig = yawrig_rig::Rig::default();
    let mut planned = yawrig_campaign::simulated::plan(&rig, 10.0, 1, 1).expect("a plan");
    planned.truncate(2);
    let campaign = yawrig_campaign::simulated::describe(&rig, &planned);
    let mut measuring = Measuring::new(Plan { campaign, stays: false }, None).expect("a plan");
    measuring.announced = true;
    measuring
}

fn take(measuring: &mut Measuring, event: Event) {
    let item = Item::Event { at: 0, event, trends: Vec::new(), names: Vec::new() };
    measuring.take(&item, None).expect("nothing is written");
}

fn let_go(release: u32) -> Event {
    Event::Phase { phase: Phase::Released, release, at_sample: 0 }
}

fn result(release: u32, flags: Flags) -> Event {
    let measured = Measured { value: 5.0, u: 0.001 };
    Event::Release(ReleaseResult { release, flags, ..of_network(measured) })
}

/// A release of five windows, whose natural frequency and damping ratio are this number.
pub(crate) fn of_network(measured: Measured) -> ReleaseResult {
    ReleaseResult {
        release: 0,
        release_sample: 0,
        finished_sample: 1000,
        windows: 5,
        natural_frequency_rad_s: measured,
        damping_ratio: measured,
        numbers: Default::default(),
        derivatives: None,
        flags: Flags(0),
    }
}

#[test]
fn a_release_that_the_device_takes_no_reference_from_is_made_again() {
    let mut measuring = measuring();
    take(&mut measuring, let_go(0));
    take(&mut measuring, result(0, Flags::SPIKES));
    assert_eq!((measuring.at, measuring.announced), (0, false));
    assert_eq!(measuring.not_counted.as_deref(), Some("spikes"));
    measuring.announced = true;
    take(&mut measuring, let_go(1));
    take(&mut measuring, result(1, Flags(0)));
    // The next one is announced when all is known of this one.
    assert_eq!((measuring.at, measuring.waiting.is_some()), (0, true));
    let natural_frequency_rad_s = Precise { value: 4.85, u: 1e-4 };
    take(
        &mut measuring,
        Event::Refined(Refined { release: 1, natural_frequency_rad_s, ..Refined::default() }),
    );
    assert_eq!((measuring.at, measuring.waiting.is_some()), (1, false));
    // Kr = 2 Ks b^2 over the refined wn^2, and not over the network's.
    let inertia = measuring.inertia_kg_m2(Axis::Mid).expect("from the wind-off release");
    assert!((inertia - 2.38 / 4.85 / 4.85).abs() < 1e-12, "{inertia}");
    // Wind on, spikes were bridged and the flag says so.
    measuring.announced = true;
    take(&mut measuring, let_go(2));
    take(&mut measuring, result(2, Flags::SPIKES));
    assert_eq!(measuring.not_counted, None);
}

/// What the network says there is none to rely on; the refined estimate may be.
#[test]
fn outside_the_trained_range_a_release_counts_by_its_refined_estimate() {
    let mut measuring = measuring();
    for (round, flags, at) in [(0, Flags::NOT_REFINED, 0), (1, Flags::MISFIT, 0), (2, Flags(0), 1)]
    {
        measuring.announced = true;
        take(&mut measuring, let_go(round));
        take(&mut measuring, result(round, Flags::OUT_OF_RANGE));
        assert!(measuring.waiting.is_some());
        let refined = Refined { release: round, flags, ..Refined::default() };
        take(&mut measuring, Event::Refined(refined));
        assert_eq!((measuring.at, measuring.made.len()), (at, at), "{flags:?}");
        let why = measuring.not_counted.as_deref();
        assert_eq!(why, (at == 0).then_some("out_of_trained_range"), "{flags:?}");
    }
    // Wind on, a misfit says so itself.
    measuring.announced = true;
    take(&mut measuring, let_go(3));
    take(&mut measuring, result(3, Flags::OUT_OF_RANGE));
    let refined = Refined { release: 3, flags: Flags::MISFIT, ..Refined::default() };
    take(&mut measuring, Event::Refined(refined));
    assert_eq!((measuring.made.len(), measuring.not_counted.as_deref()), (2, None));
}

#[test]
fn a_release_made_under_another_programs_condition_does_not_count() {
    let mut measuring = measuring();
    let entry = &measuring.plan.campaign.release[0];
    let told = condition(&measuring.plan.campaign, entry, None);
    measuring.told = Some(told);
    for (found, counts) in [(Some(told), 1), (None, 1), (Some(Condition { rig: 7, ..told }), 0)] {
        measuring.go_to(0);
        measuring.made.clear();
        measuring.announced = true;
        take(&mut measuring, let_go(0));
        take(&mut measuring, result(0, Flags(0)));
        assert!(std::mem::take(&mut measuring.unchecked));
        measuring.made_under(found).expect("no file");
        assert_eq!((measuring.made.len(), measuring.at), (counts, 0), "{found:?}");
        measuring.under_way = None;
    }
    // It is told again before the release is made again.
    assert_eq!((measuring.told, measuring.announced), (None, false));
    assert!(measuring.not_counted.is_some_and(|why| why.contains("another program")));
}

#[test]
fn a_release_that_began_under_another_condition_does_not_count() {
    let mut measuring = measuring();
    take(&mut measuring, let_go(0));
    measuring.skip();
    measuring.announced = true;
    take(&mut measuring, result(0, Flags(0)));
    assert_eq!((measuring.at, measuring.made.len()), (1, 0));
    // Nor one that was let go before the device was told.
    measuring.announced = false;
    take(&mut measuring, let_go(1));
    measuring.announced = true;
    take(&mut measuring, result(1, Flags(0)));
    assert_eq!((measuring.at, measuring.made.len()), (1, 0));
}

/// One of the built-in rig's that was still held when the campaign began: it is let go under another
/// condition.
#[test]
fn a_release_that_the_rig_had_begun_before_does_not_count() {
    let bench = Bench::open(&Target::Emulated).expect("a device");
    let mut session = Session::new(bench, Follow::Results).expect("it answers");
    let mut built_in = BuiltInRig::new(1.0);
    while session.bench().client.status().expect("its state").phase != Phase::Held {
        built_in.play(session.bench(), 50).expect("it takes them");
    }
    built_in.wait();
    let rig = yawrig_rig::Rig::default();
    let planned = yawrig_campaign::simulated::plan(&rig, 10.0, 1, 1).expect("a plan");
    let mut campaign = yawrig_campaign::simulated::describe(&rig, &planned);
    campaign.release.retain(|r| r.spring == "K3");
    let mut measuring = Measuring::new(Plan { campaign, stays: false }, None).expect("a plan");
    let mut not_counted = Vec::new();
    let mut played = 0;
    while measuring.made.is_empty() {
        assert!(played < 400_000, "none counts");
        measuring.go_on(&mut session, Some(&mut built_in)).expect("a device");
        built_in.play(session.bench(), 500).expect("it takes them");
        played += 500;
        // What it has said before comes with its answer.
        session.bench().client.status().expect("its state");
        while let Some(item) = session.next(Duration::ZERO).expect("a device") {
            measuring.take(&item, None).expect("nothing is written");
            if let Item::Condition { next, .. } = &item {
                not_counted.extend(next.not_counted.clone());
            }
        }
    }
    assert_eq!(not_counted, ["it had begun before the device was given the condition"]);
    let spring = yawrig_rig::Spring::named("K3").expect("a spring");
    let made = yawrig_rig::Condition { spring, axis: Axis::Mid, wind_speed_m_s: 0.0 };
    let truth = rig.modal(&made).expect("it swings").natural_frequency_rad_s;
    let found = f64::from(measuring.made[0].1.result.natural_frequency_rad_s.value);
    assert!((found / truth - 1.0).abs() < 0.02, "{found} {truth}");
}

#[test]
fn a_reference_at_one_setting_is_another_rig_to_the_device() {
    let rig = yawrig_rig::Rig::default();
    let planned = yawrig_campaign::simulated::plan(&rig, 10.0, 1, 1).expect("a plan");
    let mut campaign = yawrig_campaign::simulated::describe(&rig, &planned[..4]);
    let at = |wing: &str| At([("wing".to_owned(), Value::Text(wing.to_owned()))].into());
    let off = campaign.release[0].clone();
    assert_eq!(off.wind_speed_m_s, 0.0);
    let made = |wind_speed_m_s, at| ReleaseEntry { wind_speed_m_s, at, ..off.clone() };
    let id = |campaign: &Campaign, entry: &ReleaseEntry| condition(campaign, entry, None).rig;

    // One reference that serves all settings.
    campaign.release = vec![off.clone(), made(10.0, at("low")), made(10.0, at("high"))];
    let rigs: Vec<u32> = campaign.release.iter().map(|r| id(&campaign, r)).collect();
    assert!(rigs.iter().all(|rig| *rig == rigs[0]), "{rigs:?}");
    // One each.
    let [low, high] = ["low", "high"].map(at);
    campaign.release = [(0.0, &low), (0.0, &high), (10.0, &low), (10.0, &high)]
        .map(|(wind, at)| made(wind, at.clone()))
        .to_vec();
    let rigs: Vec<u32> = campaign.release.iter().map(|r| id(&campaign, r)).collect();
    assert_eq!((rigs[0], rigs[1]), (rigs[2], rigs[3]));
    assert_ne!(rigs[0], rigs[1]);
    // A record of one setting is none of the other.
    assert!(!are_repeats(&campaign.release[0], &campaign.release[1]));
}
