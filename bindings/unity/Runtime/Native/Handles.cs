using System;
using System.Runtime.InteropServices;

namespace Unic.Native
{
    /// <summary>Owner of a native model, who releases it once.</summary>
    internal sealed class ModelHandle : SafeHandle
    {
        internal ModelHandle(IntPtr handle) : base(IntPtr.Zero, true)
        {
            SetHandle(handle);
        }

        /// <inheritdoc/>
        public override bool IsInvalid => handle == IntPtr.Zero;

        /// <inheritdoc/>
        protected override bool ReleaseHandle()
        {
            return NativeMethods.unic_model_release(handle) == UnicStatus.Ok;
        }
    }

    /// <summary>Owner of a native instance, who releases it once.</summary>
    internal sealed class InstanceHandle : SafeHandle
    {
        internal InstanceHandle(IntPtr handle) : base(IntPtr.Zero, true)
        {
            SetHandle(handle);
        }

        /// <inheritdoc/>
        public override bool IsInvalid => handle == IntPtr.Zero;

        /// <inheritdoc/>
        protected override bool ReleaseHandle()
        {
            return NativeMethods.unic_instance_release(handle) == UnicStatus.Ok;
        }
    }
}
