using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("Unic.Garments.Editor")]
[assembly: InternalsVisibleTo("Unic.Garments.Tests")]
[assembly: InternalsVisibleTo("Unic.Garments.MonoTests")]
