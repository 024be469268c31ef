namespace Unic.Native
{
    // The numbers of unic.h. Tests~/Layout compares names and values with the header.

    /// <summary>Result of a native call.</summary>
    public enum UnicStatus : uint
    {
        /// <summary>Success.</summary>
        Ok = 0,
        /// <summary>A pointer that must not be null is null.</summary>
        NullPointer = 1,
        /// <summary>A pointer to a struct is not aligned as its type asks.</summary>
        Misaligned = 2,
        /// <summary>A handle that was never made, or that is released.</summary>
        InvalidHandle = 3,
        /// <summary>The instance is in use by another thread.</summary>
        InUse = 4,
        /// <summary>A count, a stride or the size of a struct is not the expected one.</summary>
        WrongSize = 5,
        /// <summary>A number that is not accepted, such as NaN.</summary>
        InvalidValue = 6,
        /// <summary>Bytes that are not a model which this version reads.</summary>
        BadModel = 7,
        /// <summary>A file that cannot be read.</summary>
        CannotRead = 8,
        /// <summary>Bytes that are not a saved state of this model.</summary>
        BadState = 9,
        /// <summary>A buffer that is too small for what is written to it.</summary>
        BufferTooSmall = 10,
        /// <summary>Threads that the system does not start.</summary>
        OutOfThreads = 11,
        /// <summary>A fault of the library. The instance can only be released.</summary>
        Panic = 12,
        /// <summary>An instance in which an earlier call has ended with a fault.</summary>
        Broken = 13,
    }

    /// <summary>Axes and unit of everything that an instance takes and gives.</summary>
    public enum UnicAxes : uint
    {
        /// <summary>Right-handed, +Y up, the character faces +Z, metres.</summary>
        Model = 0,
        /// <summary>Left-handed, +Y up, the character faces +Z, metres.</summary>
        Unity = 1,
        /// <summary>Left-handed, +Z up, the character faces +X, centimetres.</summary>
        Unreal = 2,
        /// <summary>Right-handed, +Z up, the character faces -Y, metres.</summary>
        Blender = 3,
        /// <summary>Those of customAxes and metresPerUnit.</summary>
        Custom = 4,
    }

    /// <summary>Vertices that are written.</summary>
    public enum UnicVertexLayout : uint
    {
        /// <summary>Those of the model, in its order.</summary>
        Model = 0,
        /// <summary>Those of the model, then copies of vertices at texture seams.</summary>
        Split = 1,
    }

    /// <summary>Mesh of an instance.</summary>
    public enum UnicMesh : uint
    {
        /// <summary>The garment.</summary>
        Garment = 0,
        /// <summary>The character's body.</summary>
        Body = 1,
    }

    /// <summary>Meaning of the root's position in a pose.</summary>
    public enum UnicRoot : uint
    {
        /// <summary>World position of the root joint.</summary>
        Position = 0,
        /// <summary>World position of the root joint minus its rest position.</summary>
        Translation = 1,
    }

    /// <summary>Meaning of the rotations in a pose.</summary>
    public enum UnicRotations : uint
    {
        /// <summary>Relative to the parent joint.</summary>
        Local = 0,
        /// <summary>In the world.</summary>
        World = 1,
        /// <summary>In the world, from the rest pose.</summary>
        FromRest = 2,
    }

    /// <summary>Shape of a collider.</summary>
    public enum UnicShape : uint
    {
        /// <summary>Everything behind the plane through a that faces b.</summary>
        HalfSpace = 0,
        /// <summary>Ball around a.</summary>
        Sphere = 1,
        /// <summary>Capsule with an axis from a to b.</summary>
        Capsule = 2,
    }
}

namespace Unic
{
    /// <summary>Number format of the networks.</summary>
    public enum UnicPrecision : uint
    {
        /// <summary>The fastest one of the processor that is about as exact as F32.</summary>
        Auto = 0,
        /// <summary>Single precision.</summary>
        F32 = 1,
        /// <summary>bfloat16.</summary>
        Bf16 = 2,
        /// <summary>16-bit integers.</summary>
        Int16 = 3,
        /// <summary>8-bit integers.</summary>
        Int8 = 4,
    }

    /// <summary>Handling of garment vertices inside the body.</summary>
    public enum UnicIntersection : uint
    {
        /// <summary>The rule that the model was made with.</summary>
        Model = 0,
        /// <summary>Vertices inside the body stay there.</summary>
        Off = 1,
        /// <summary>Rule of the paper: over the nearest body vertex, in the state.</summary>
        Paper = 2,
        /// <summary>Shown vertices leave the body and the colliders the shortest way.</summary>
        Robust = 3,
        /// <summary>The same, and the state is corrected too.</summary>
        RobustState = 4,
    }

    /// <summary>Threads that one step works on.</summary>
    public enum UnicThreads : uint
    {
        /// <summary>The calling thread alone.</summary>
        None = 0,
        /// <summary>The calling thread and workers of the native library.</summary>
        Pool = 1,
        /// <summary>Callbacks. This package does not use them.</summary>
        Caller = 2,
    }

    /// <summary>Features of the native library on a machine. Each is a bit of unic_features.</summary>
    internal enum UnicFeature : ulong
    {
        /// <summary>Models are read from paths.</summary>
        Paths = 1,
        /// <summary>The library has a pool of threads.</summary>
        Pool = 2,
        /// <summary>This processor has instructions for bfloat16.</summary>
        Bf16Instructions = 4,
        /// <summary>This processor has instructions for 8-bit integers.</summary>
        Int8Instructions = 8,
    }
}
