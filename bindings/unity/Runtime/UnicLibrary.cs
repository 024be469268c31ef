using System;
using Unic.Native;

namespace Unic
{
    /// <summary>The native library: its version, and whether it can be used.</summary>
    public static unsafe class UnicLibrary
    {
        private static bool isChecked;

        /// <summary>Version of the native library, such as 0.1.0.</summary>
        /// <exception cref="UnicException">The library is missing or of another version.</exception>
        public static string Version
        {
            get
            {
                Require();
                return NativeText.Read(NativeMethods.unic_version());
            }
        }

        /// <summary>Whether the native library has threads of its own on this platform.</summary>
        public static bool HasPool
        {
            get
            {
                Require();
                return (NativeMethods.unic_features() & (ulong)UnicFeature.Pool) != 0;
            }
        }

        /// <summary>Loads the native library and compares its interface with this package's.</summary>
        /// <exception cref="UnicException">The library is missing or of another version.</exception>
        public static void Require()
        {
            if (isChecked) return;
            uint found;
            try
            {
                found = NativeMethods.unic_abi_version();
            }
            catch (Exception error) when (error is DllNotFoundException || error is EntryPointNotFoundException
                                          || error is BadImageFormatException)
            {
                throw new UnicException("expected the native library unic for this platform, cannot load: "
                                        + error.Message);
            }
            if (found != NativeMethods.UNIC_ABI_VERSION)
                throw new UnicException("expected a native library with interface " + NativeMethods.UNIC_ABI_VERSION
                                        + ", found interface " + found);
            isChecked = true;
        }
    }
}
