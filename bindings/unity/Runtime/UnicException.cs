using System;
using Unic.Native;

namespace Unic
{
    /// <summary>Error of a model, a rig or the native library. The message is one sentence.</summary>
    public sealed class UnicException : Exception
    {
        /// <summary>Code of the native call. Ok for errors that this package has found itself.</summary>
        public UnicStatus Status { get; }

        internal UnicException(UnicStatus status, string message) : base(message)
        {
            Status = status;
        }

        internal UnicException(string message) : this(UnicStatus.Ok, message)
        {
        }
    }
}
