//! USD as text.

use super::{CORNERS, SIDES};

/// The rod as a UsdSkel character at 20 fps.
pub const ROD_USDA: &str = r#"#usda 1.0
(
    defaultPrim = "rig"
    metersPerUnit = 0.01
    upAxis = "Z"
    timeCodesPerSecond = 20
    framesPerSecond = 20
)

def SkelRoot "rig" (
    prepend apiSchemas = ["SkelBindingAPI"]
)
{
    rel skel:skeleton = </rig/bones>
    rel skel:animationSource = </rig/bones/bend>

    def Skeleton "bones"
    {
        uniform token[] joints = ["hips", "hips/chest"]
        uniform matrix4d[] bindTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 50, 1))]
        uniform matrix4d[] restTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 50, 1))]

        def SkelAnimation "bend"
        {
            uniform token[] joints = ["hips", "hips/chest"]
            float3[] translations.timeSamples = {
                0: [(0, 0, 0), (0, 0, 50)],
                20: [(0, 100, 0), (0, 0, 50)],
            }
            quatf[] rotations.timeSamples = {
                0: [(1, 0, 0, 0), (1, 0, 0, 0)],
                20: [(1, 0, 0, 0), (0.87758256, 0.47942554, 0, 0)],
            }
            half3[] scales = [(1, 1, 1), (1, 1, 1)]
        }
    }

    def Mesh "body"
    {
        point3f[] points = [(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0),
            (-10, -10, 100), (10, -10, 100), (10, 10, 100), (-10, 10, 100)]
        int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
        int[] faceVertexIndices = [0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7]
        int[] primvars:skel:jointIndices = [0, 0, 0, 0, 1, 1, 1, 1] (
            elementSize = 1
            interpolation = "vertex"
        )
        float[] primvars:skel:jointWeights = [1, 1, 1, 1, 1, 1, 1, 1] (
            elementSize = 1
            interpolation = "vertex"
        )
        matrix4d primvars:skel:geomBindTransform = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    }
}
"#;

/// The box as a mesh `cloth` whose points sink by 10 units a frame, `frames` times, below a parent
/// that turns and moves it; `metadata` states units, axes and rates.
pub fn rod_garment_usda(metadata: &str, frames: usize) -> String {
    let frame = |frame: usize| {
        let sunk = CORNERS.map(|[x, y, z]| format!("({x}, {y}, {})", z - 10.0 * frame as f64));
        format!("                {frame}: [{}],\n", sunk.join(", "))
    };
    let points: String = (0..frames).map(frame).collect();
    let sides: Vec<String> = SIDES.concat().iter().map(i32::to_string).collect();
    format!(
        r#"#usda 1.0
({metadata})

def Xform "parent"
{{
    double3 xformOp:translate = (100, 0, 0)
    double xformOp:rotateZ = 90
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]

    def Mesh "cloth"
    {{
        point3f[] points.timeSamples = {{
{points}        }}
        int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
        int[] faceVertexIndices = [{}]
    }}

    def Mesh "hat"
    {{
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
    }}
}}
"#,
        sides.join(", ")
    )
}
