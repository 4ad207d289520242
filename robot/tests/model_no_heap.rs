//! What a step asks the model touches no heap.

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use probepath_frames::{Flange, Pose};
use probepath_robot::{Joints, Model};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

#[test]
fn forward_jacobian_singular_values_and_refine_touch_no_heap() {
    for arm in [Model::ur5e(), Model::seven_joint()] {
        let mut near = Joints::splat(arm.joints(), 0.4);
        near[3] = -1.5;
        let goal = arm.forward(&near.map(|q| q + 0.003));
        let found = assert_no_alloc(|| {
            let tool = Pose::<Flange, Flange>::identity();
            let jacobian = arm.jacobian(&near, &tool);
            let regular = jacobian.smallest_singular_value() > 1e-3 && jacobian.manipulability() > 1e-6;
            let inside = arm.outside_limits(&near, 0.0).is_none();
            let found = arm.refine(&goal, &tool, &near).map(|found| arm.forward(&found));
            found.filter(|_| regular && inside)
        });
        let (metres, radians) = found.expect("a tick away, at a regular posture").distance(&goal);
        assert!(metres < 1e-11 && radians < 1e-7);
    }
}
