using System.Text;

namespace Unic.Native
{
    /// <summary>Texts and statuses of the native library.</summary>
    internal static unsafe class NativeText
    {
        /// <summary>Copies a text that ends with a zero byte. Null gives null.</summary>
        internal static string Read(byte* text)
        {
            if (text == null) return null;
            int length = 0;
            while (text[length] != 0) length++;
            return length == 0 ? "" : Encoding.UTF8.GetString(text, length);
        }

        /// <summary>Throws the library's sentence if a call has failed.</summary>
        internal static void Check(UnicStatus status)
        {
            if (status != UnicStatus.Ok) throw new UnicException(status, Read(NativeMethods.unic_last_error()));
        }
    }
}
