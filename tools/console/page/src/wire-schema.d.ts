declare module 'wire-schema' {
  export const messages: Record<string, Record<number, [name: string, type: string, repeated: boolean]>>;
  export const enums: Record<string, Record<number, string>>;
}
