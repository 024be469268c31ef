using System;
using System.Collections.Generic;
using System.Text;

namespace Unic
{
    /// <summary>
    /// Header and arrays of a .unic file, for inspectors and for bodies that are drawn by skinning.
    /// </summary>
    public sealed class UnicModelFile
    {
        private readonly byte[] bytes;
        private readonly int arrays;
        private readonly Dictionary<string, object> header;
        private readonly Dictionary<string, object> about;

        /// <summary>Reads the header of a file.</summary>
        /// <exception cref="UnicException">The bytes have no header of a model.</exception>
        public UnicModelFile(byte[] bytes)
        {
            this.bytes = bytes;
            if (bytes.Length < 8) throw new UnicException("expected a .unic file, found " + bytes.Length + " bytes");
            ulong length = BitConverter.ToUInt64(bytes, 0);
            if (length > (ulong)bytes.Length - 8)
                throw new UnicException("expected a .unic file, found a header that is longer than the file");
            arrays = 8 + (int)length;
            header = Members(JsonReader.Read(Encoding.UTF8.GetString(bytes, 8, (int)length)));
            string unic = Get(Members(Get(header, "__metadata__")), "unic") as string;
            if (unic == null) throw new UnicException("expected a .unic file, found no entry unic in the header");
            about = Members(Get(Members(JsonReader.Read(unic)), "about"));
        }

        /// <summary>Name of the capture; empty if the file has none.</summary>
        public string Name => Get(about, "name") as string ?? "";

        /// <summary>Where the capture comes from; empty if the file does not say.</summary>
        public string Provenance => Get(about, "provenance") as string ?? "";

        /// <summary>Program that has trained the model; empty if the file does not say.</summary>
        public string Program => Get(Members(Get(about, "training")), "program") as string ?? "";

        /// <summary>Seconds of the training; 0 if the file does not say.</summary>
        public double TrainingSeconds => Get(Members(Get(about, "training")), "seconds") as double? ?? 0.0;

        /// <summary>Whether the file has an array.</summary>
        public bool Has(string name)
        {
            return header.ContainsKey(name);
        }

        /// <summary>Numbers of an array of type F32, row by row.</summary>
        /// <exception cref="UnicException">There is no such array.</exception>
        public float[] Floats(string name)
        {
            return (float[])Copy(name, "F32", typeof(float), 4);
        }

        /// <summary>Numbers of an array of type U32, row by row.</summary>
        /// <exception cref="UnicException">There is no such array.</exception>
        public uint[] UInts(string name)
        {
            return (uint[])Copy(name, "U32", typeof(uint), 4);
        }

        /// <summary>Numbers of an array of type U16, row by row.</summary>
        /// <exception cref="UnicException">There is no such array.</exception>
        public ushort[] UShorts(string name)
        {
            return (ushort[])Copy(name, "U16", typeof(ushort), 2);
        }

        private Array Copy(string name, string type, Type element, int size)
        {
            Dictionary<string, object> entry = Members(Get(header, name));
            List<object> range = Get(entry, "data_offsets") as List<object>;
            if (Get(entry, "dtype") as string != type || range == null || range.Count != 2)
                throw new UnicException("expected an array " + name + " of type " + type + ", found none");
            double start = range[0] as double? ?? -1.0, end = range[1] as double? ?? -1.0;
            if (!(start >= 0.0 && start <= end && end <= bytes.Length - arrays))
                throw new UnicException("expected the array " + name + " within the file, found bytes " + start + " to " + end);
            int length = (int)(end - start);
            Array copy = Array.CreateInstance(element, length / size);
            Buffer.BlockCopy(bytes, arrays + (int)start, copy, 0, length / size * size);
            return copy;
        }

        private static object Get(Dictionary<string, object> members, string key)
        {
            object value;
            return members.TryGetValue(key, out value) ? value : null;
        }

        private static Dictionary<string, object> Members(object value)
        {
            return value as Dictionary<string, object> ?? new Dictionary<string, object>();
        }
    }
}
