//! What a URDF may be wrong in, and what the model says of it.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a test's own helpers may stop at the first surprise, and say what they measured"
)]

use probepath_robot::{Joints, MAX_JOINTS, Model, ModelError, ModelWarning, PANDA_URDF, UR5E_URDF};

const GANTRY: &str = include_str!("../../tests/golden/kinematics/gantry.urdf");

/// A chain a - b - c with the given joints' insides.
fn two(first: &str, second: &str) -> String {
    format!(
        "<robot name='two'><link name='a'/><link name='b'/><link name='c'/>\n\
         <joint name='one' {first}<parent link='a'/><child link='b'/></joint>\n\
         <joint name='two' {second}<parent link='b'/><child link='c'/></joint></robot>"
    )
}

const GOOD: &str = "type='revolute'><axis xyz='0 0 1'/><limit lower='-1' upper='1' velocity='2' effort='3'/>";

fn read(text: &str) -> Result<(Model, Vec<ModelWarning>), ModelError> {
    Model::from_urdf(text, "cell.urdf", "a", "c")
}

/// The refusal names the file and everything else it has to.
fn refused(text: &str, words: &[&str]) -> ModelError {
    let error = read(text).expect_err(text);
    let message = error.to_string();
    for word in words.iter().chain(&["cell.urdf"]) {
        assert!(message.contains(word), "{word:?} is not in: {message}");
    }
    error
}

fn limit(attributes: &str) -> String {
    two(GOOD, &format!("type='revolute'><axis xyz='0 0 1'/><limit {attributes}/>"))
}

#[test]
fn a_plain_chain_is_read_with_its_limits() {
    let (arm, warnings) = read(&two(GOOD, GOOD)).unwrap();
    assert_eq!((arm.joints(), warnings.len(), arm.name()), (2, 0, "two"));
    let limit = arm.limits()[1];
    assert_eq!((limit.lower, limit.upper, limit.velocity, limit.effort), (-1.0, 1.0, 2.0, 3.0));
    let (marked, _) = read(&format!("\u{feff}{}", two(GOOD, GOOD))).unwrap();
    assert_eq!(marked, arm);
}

#[test]
fn what_is_not_a_urdf_is_refused() {
    for text in
        ["", "hello", "<html><body/></html>", "{\"robot\": 1}", "<robot name='r'/>", "<robot", "\0\0\0"]
    {
        assert!(matches!(refused(text, &["not a URDF"]), ModelError::NotUrdf { .. }), "{text}");
    }
}

#[test]
fn elements_nested_without_end_are_refused_before_the_reader_recurses() {
    let deep = format!("<robot name='r'>{}{}</robot>", "<link>".repeat(300_000), "</link>".repeat(300_000));
    refused(&deep, &["nested more than 64 deep"]);
}

#[test]
fn a_link_that_is_not_there_is_refused_with_those_that_are() {
    let error = Model::from_urdf(UR5E_URDF, "ur5e.urdf", "base_link", "tool1").unwrap_err().to_string();
    assert!(error.contains("\"tool1\"") && error.contains("wrist_3_link, tool0"), "{error}");
}

#[test]
fn a_joint_whose_parent_is_its_child_is_a_loop() {
    let text = two(GOOD, GOOD).replace("<parent link='b'/>", "<parent link='c'/>");
    assert!(matches!(refused(&text, &["two", "own ancestor"]), ModelError::Loop { .. }));
}

#[test]
fn a_ring_of_joints_is_a_loop() {
    let text = two(GOOD, GOOD).replace(
        "</robot>",
        &format!("<joint name='three' {GOOD}<parent link='c'/><child link='a'/></joint></robot>"),
    );
    assert!(matches!(refused(&text, &["own ancestor"]), ModelError::Loop { .. }));
}

#[test]
fn a_link_with_two_parents_is_refused_with_both() {
    let text = two(GOOD, GOOD).replace(
        "</robot>",
        &format!("<joint name='three' {GOOD}<parent link='a'/><child link='c'/></joint></robot>"),
    );
    assert!(matches!(refused(&text, &["two", "three", "closed chain"]), ModelError::TwoParents { .. }));
}

#[test]
fn links_in_separate_trees_are_refused() {
    let text = two(GOOD, GOOD).replace("</robot>", "<link name='d'/></robot>");
    let error = Model::from_urdf(&text, "cell.urdf", "d", "c").unwrap_err();
    assert!(matches!(error, ModelError::NoChain { ref root, .. } if root == "a"), "{error}");
}

#[test]
fn names_that_are_not_unique_or_not_there_are_refused() {
    let text = two(GOOD, GOOD);
    refused(&text.replace("name='two' type", "name='one' type"), &["two joints", "\"one\""]);
    refused(&text.replace("<link name='b'/>", "<link name='b'/><link name='b'/>"), &["two links", "\"b\""]);
    refused(&text.replace("<child link='c'/>", "<child link='d'/>"), &["two", "child", "\"d\""]);
}

#[test]
fn an_axis_without_direction_is_refused() {
    for axis in ["0 0 0", "NaN 0 1", "1e-9 0 0", "inf 0 0"] {
        let second = GOOD.replace("0 0 1", axis);
        refused(&two(GOOD, &second), &["joint \"two\"", "axis xyz", "direction of length one"]);
    }
}

#[test]
fn a_vector_that_is_not_three_numbers_is_refused() {
    for axis in ["0 O.5 0 1", "0 1", "", "0,0,1", "1 2 3 4"] {
        refused(&two(GOOD, &GOOD.replace("0 0 1", axis)), &["xyz", "three numbers"]);
    }
}

#[test]
fn limits_that_cannot_be_are_refused() {
    refused(
        &limit("lower='NaN' upper='1' velocity='1'"),
        &["joint \"two\"", "limit lower to upper", "finite"],
    );
    refused(&limit("lower='2' upper='1' velocity='1'"), &["2 to 1", "swap"]);
    refused(&limit("velocity='1'"), &["0 to 0", "write both limits"]);
    refused(&limit("lower='-1' upper='1' velocity='0'"), &["limit velocity", "data sheet"]);
    refused(&limit("lower='-1' upper='1' velocity='NaN'"), &["limit velocity"]);
    refused(&limit("lower='-1' upper='1' velocity='1' effort='-2'"), &["limit effort"]);
    refused(&two(GOOD, "type='revolute'><axis xyz='0 0 1'/>"), &["limit velocity"]);
}

#[test]
fn an_origin_that_cannot_be_is_refused() {
    for (origin, word) in
        [("xyz='1e300 0 0'", "metres"), ("xyz='NaN 0 0'", "metres"), ("rpy='0 inf 0'", "radians")]
    {
        refused(
            &two(GOOD, &GOOD.replace("<axis", &format!("<origin {origin}/><axis"))),
            &["joint \"two\"", word],
        );
    }
}

#[test]
fn joints_that_no_serial_arm_has_are_refused_by_name() {
    for kind in ["floating", "planar", "spherical"] {
        let error = refused(&two(GOOD, &GOOD.replace("revolute", kind)), &["joint \"two\"", kind]);
        assert!(matches!(error, ModelError::NotSupported { .. }));
    }
}

#[test]
fn a_floating_joint_off_the_chain_is_a_warning() {
    let text = two(GOOD, &GOOD.replace("revolute", "floating"));
    let (arm, warnings) = Model::from_urdf(&text, "cell.urdf", "a", "b").unwrap();
    assert_eq!(arm.joints(), 1);
    assert_eq!(warnings, [ModelWarning::JointLeftOut { joint: "two".into(), kind: "floating" }]);
}

#[test]
fn more_joints_than_fit_and_none_at_all_are_refused() {
    let mut text = String::from("<robot name='snake'><link name='a'/>");
    for j in 0..=MAX_JOINTS {
        let (parent, child) =
            if j == 0 { ("a".into(), "l0".into()) } else { (format!("l{}", j - 1), format!("l{j}")) };
        text += &format!(
            "<link name='{child}'/><joint name='j{j}' {GOOD}<parent link='{parent}'/><child link='{child}'/></joint>"
        );
    }
    let text = text.replace("'l8'", "'c'") + "</robot>";
    assert!(matches!(refused(&text, &["9 joints", "at most 8"]), ModelError::TooManyJoints { found: 9, .. }));
    let still = "type='fixed'>";
    assert!(matches!(refused(&two(still, still), &["no joint"]), ModelError::NoJoints { .. }));
}

#[test]
fn a_mimic_joint_without_its_master_is_refused() {
    let mimics = |of: &str, by: &str| format!("{GOOD}<mimic joint='{of}' multiplier='{by}'/>");
    refused(&two(GOOD, &mimics("three", "1")), &["joint \"two\"", "\"three\"", "not in the file"]);
    refused(&two(&mimics("two", "1"), &mimics("one", "1")), &["mimics it in turn"]);
    refused(&two(GOOD, &mimics("one", "NaN")), &["mimic multiplier"]);
    let error = Model::from_urdf(GANTRY, "gantry.urdf", "carriage", "flange").unwrap_err().to_string();
    assert!(
        error.contains("\"plunger\"") && error.contains("\"trolley\", which does not move between"),
        "{error}"
    );
}

#[test]
fn a_mimic_joint_s_limits_hold_for_its_master() {
    let mimic = "type='revolute'><axis xyz='0 0 1'/><limit lower='-1' upper='0.5' velocity='2'/>\
                 <mimic joint='one' multiplier='-2' offset='0.1'/>";
    let (arm, _) = read(&two(GOOD, mimic)).unwrap();
    let limit = arm.limits()[0];
    assert_eq!(arm.joints(), 1);
    assert!((limit.lower + 0.2).abs() < 1e-15 && (limit.upper - 0.55).abs() < 1e-15, "{limit:?}");
    assert!((limit.velocity - 1.0).abs() < 1e-15);
    let apart = mimic.replace("offset='0.1'", "offset='9'");
    refused(&two(GOOD, &apart), &["joint \"two\"", "no position is left"]);
}

#[test]
fn a_missing_mesh_is_a_warning_and_a_mesh_of_a_package_is_found() {
    let folder = std::env::temp_dir().join(format!("probepath-mesh-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("arm_description/meshes")).unwrap();
    std::fs::create_dir_all(folder.join("arm_description/urdf")).unwrap();
    std::fs::write(folder.join("arm_description/meshes/a.stl"), "solid a").unwrap();
    let shown = |mesh: &str| format!("<visual><geometry><mesh filename='{mesh}'/></geometry></visual>");
    let text = two(GOOD, GOOD)
        .replace(
            "<link name='a'/>",
            &format!("<link name='a'>{}</link>", shown("package://arm_description/meshes/a.stl")),
        )
        .replace("<link name='b'/>", &format!("<link name='b'>{}</link>", shown("package://other/b.stl")));
    let file = folder.join("arm_description/urdf/arm.urdf");
    std::fs::write(&file, text).unwrap();
    let (arm, warnings) = Model::from_urdf_file(&file, "a", "c").unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(arm.meshes().len(), 1);
    assert!(arm.meshes()[0].path.ends_with("arm_description/meshes/a.stl"));
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].to_string().contains("package://other/b.stl"), "{}", warnings[0]);
}

#[test]
fn a_file_that_cannot_be_read_is_refused_by_name() {
    let error = Model::from_urdf_file("no/such.urdf".as_ref(), "a", "b").unwrap_err().to_string();
    assert!(error.starts_with("no/such.urdf: cannot be read"), "{error}");
}

#[test]
fn a_file_without_end_is_refused() {
    let zero = std::path::Path::new("/dev/zero");
    if !zero.exists() {
        println!("skipped: this system has no /dev/zero");
        return;
    }
    let error = Model::from_urdf_file(zero, "a", "b").unwrap_err().to_string();
    assert!(error.contains("longer than 32 MiB"), "{error}");
}

#[test]
fn the_ends_of_a_urdf_are_its_root_and_its_tips_the_longest_first() {
    let (root, tips) = Model::ends_of_urdf(GANTRY, "gantry.urdf").unwrap();
    assert_eq!((root.as_str(), tips), ("floor", vec!["flange".to_owned(), "camera".to_owned()]));
    let (root, tips) = Model::ends_of_urdf(UR5E_URDF, "ur5e.urdf").unwrap();
    assert_eq!((root.as_str(), tips), ("base_link", vec!["tool0".to_owned()]));
    let ring = two(GOOD, GOOD).replace("<parent link='a'/>", "<parent link='c'/>");
    assert!(matches!(Model::ends_of_urdf(&ring, "ring.urdf"), Err(ModelError::Loop { .. })));
}

/// Numbers that look random and are the same on every machine (SplitMix64).
struct Seeded(u64);

impl Seeded {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % bound.max(1) as u64) as usize
    }

    /// Cut, flipped, repeated, or with one number edited.
    fn damage(&mut self, text: &str) -> String {
        let mut bytes = text.as_bytes().to_vec();
        let at = self.below(bytes.len());
        match self.below(5) {
            0 => bytes.truncate(at),
            1 => (0..=self.below(4)).for_each(|_| {
                let at = self.below(bytes.len());
                bytes[at] ^= 1 << self.below(8);
            }),
            2 => drop(bytes.drain(at..(at + self.below(60)).min(text.len()))),
            3 => {
                let piece = bytes[at..(at + self.below(200)).min(text.len())].to_vec();
                let to = self.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            _ => return self.edited(text),
        }
        String::from_utf8_lossy(&bytes).into_owned()
    }

    fn edited(&mut self, text: &str) -> String {
        let numbers: Vec<_> = text.match_indices(|c: char| c.is_ascii_digit()).map(|(at, _)| at).collect();
        let at = numbers[self.below(numbers.len())];
        let put = ["NaN", "inf", "-inf", "1e308", "-", "", "1e-320", "9e99", "x", "-0.0", "\u{221e}"];
        format!("{}{}{}", &text[..at], put[self.below(put.len())], &text[at + 1..])
    }
}

#[test]
fn thousands_of_damaged_files_are_read_or_refused_and_never_a_panic() {
    let files = [
        (UR5E_URDF, "base_link", "tool0"),
        (PANDA_URDF, "panda_link0", "panda_link8"),
        (GANTRY, "floor", "flange"),
        (GANTRY, "camera", "wrist"),
    ];
    let (mut seeded, mut refused) = (Seeded(7), 0);
    for round in 0..4000 {
        let (text, base, tip) = files[round % files.len()];
        let damaged = seeded.damage(text);
        match Model::from_urdf(&damaged, "damaged.urdf", base, tip) {
            Ok((arm, _)) => {
                let middle: Vec<f64> =
                    arm.limits().iter().map(|l| (l.lower.max(-3.0) + l.upper.min(3.0)) / 2.0).collect();
                let pose = arm.forward(&Joints::from_slice(&middle).unwrap());
                assert!(pose.is_finite(), "{damaged}");
                assert!(
                    arm.limits()
                        .iter()
                        .all(|l| l.lower < l.upper && l.velocity > 0.0 && l.velocity.is_finite())
                );
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().contains("damaged.urdf"), "{error}");
            }
        }
    }
    println!("{refused} of 4000 refused");
    assert!(refused > 1000, "the damage has to bite: {refused}");
}
