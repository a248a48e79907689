(** Norms of vectors that are added, cut, clamped and passed through activations. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning.
Import ListNotations.
Open Scope R_scope.

Lemma norm_nonneg u : 0 <= norm u. Proof. apply sqrt_pos. Qed.
Lemma norm_square u : norm u * norm u = square u. Proof. apply sqrt_sqrt, square_nonneg. Qed.
Lemma norm_le u v : square u <= square v -> norm u <= norm v. Proof. apply sqrt_le_1_alt. Qed.
Lemma sqrt_below x y : 0 <= y -> x <= y * y -> sqrt x <= y.
Proof. intros H G. rewrite <- (sqrt_square y) by auto. now apply sqrt_le_1_alt. Qed.
Lemma sqrt_above x y : 0 <= x -> x * x <= y -> x <= sqrt y.
Proof. intros H G. rewrite <- (sqrt_square x) by auto. now apply sqrt_le_1_alt. Qed.

Lemma cauchy u v : dotR u v <= norm u * norm v.
Proof.
  assert (dotR u v * dotR u v <= square u * square v) as H.
  { pose proof (square_nonneg u) as Hu. pose proof (square_nonneg v) as Hv.
    destruct (Req_dec (square u) 0) as [E|E].
    - rewrite E, Rmult_0_l. destruct (Req_dec (dotR u v) 0) as [->|N]; [lra|].
      pose proof (completed_square ((square v + 1) / (2 * dotR v u)) v u) as C. rewrite E in C.
      rewrite dot_comm in N. rewrite Rmult_0_r in C.
      replace (2 * ((square v + 1) / (2 * dotR v u)) * dotR v u) with (square v + 1) in C by (field; auto). lra.
    - pose proof (completed_square (dotR v u / square u) v u) as C. rewrite (dot_comm u v).
      replace (2 * (dotR v u / square u) * dotR v u) with (2 * (dotR v u * dotR v u / square u)) in C by (field; auto).
      replace (dotR v u / square u * (dotR v u / square u) * square u) with (dotR v u * dotR v u / square u) in
          C by (field; auto).
      assert (dotR v u * dotR v u / square u <= square v) as D by lra.
      apply (Rmult_le_compat_r (square u)) in D; [|auto]. unfold Rdiv in D.
      rewrite Rmult_assoc, Rinv_l, Rmult_1_r in D by auto. lra. }
  unfold norm. rewrite <- sqrt_mult by apply square_nonneg.
  destruct (Rle_dec 0 (dotR u v)); [now apply sqrt_above|].
  pose proof (sqrt_pos (square u * square v)). lra.
Qed.
Lemma norm_plus u v : norm (plusR u v) <= norm u + norm v.
Proof.
  pose proof (norm_nonneg u). pose proof (norm_nonneg v). apply sqrt_below; [lra|].
  unfold square. rewrite dot_plus_l, !dot_plus_r, (dot_comm v u). pose proof (cauchy u v).
  pose proof (norm_square u). pose proof (norm_square v). unfold square in *. nra.
Qed.
Lemma minus_through u v w : length u = length v -> length v = length w -> minus u w = plusR (minus u v) (minus v w).
Proof.
  unfold minus. revert v w. induction u as [|a u IH]; intros [|b v] [|c w]; simpl; try discriminate; intros; auto.
  rewrite <- IH by lia. f_equal. ring.
Qed.

(** |W d| for d of any length follows from that for d cut, or filled with zeros, to the length of the rows. *)
Fixpoint trim (n : nat) (d : list R) : list R :=
  match n with O => [] | S n' => hd 0 d :: trim n' (tl d) end.
Lemma length_trim n d : length (trim n d) = n. Proof. revert d. induction n; simpl; auto. Qed.
Lemma dot_trim row n d : length row = n -> dotR row (trim n d) = dotR row d.
Proof.
  revert n d. induction row as [|a row IH]; intros [|n] [|b d]; simpl; try discriminate; intros; auto.
  - rewrite IH by lia. rewrite dot_nil_r. ring.
  - rewrite IH by lia. ring.
Qed.
Lemma square_trim n d : square (trim n d) <= square d.
Proof.
  unfold square. revert d. induction n as [|n IH]; intros [|b d]; simpl; try lra.
  - pose proof (square_nonneg d). unfold square in *. nra.
  - specialize (IH []). simpl in IH. lra.
  - specialize (IH d). lra.
Qed.
Lemma minus_zeros d : minus d (repeat 0 (length d)) = d.
Proof. unfold minus. induction d as [|a d IH]; simpl; auto. rewrite IH. f_equal. ring. Qed.
Lemma apply_trim m n d : Forall (fun row => length row = n) m -> applyR m (trim n d) = applyR m d.
Proof. intros H. unfold apply. apply map_ext_in. intros r Hr. rewrite Forall_forall in H. apply dot_trim; auto. Qed.

Lemma square_between j k : 0 <= k <= j \/ j <= k <= 0 -> k * k <= j * j.
Proof. intros [[H G]|[H G]]; nra. Qed.
Lemma slopes_contract f c y y' : slopes f (- c) c -> length y = length y' ->
  square (minus (map f y) (map f y')) <= c * c * square (minus y y').
Proof.
  intros S. unfold square, minus. revert y'.
  induction y as [|a y IH]; intros [|b y']; simpl; try discriminate; intros H; try lra.
  specialize (IH y' ltac:(lia)).
  assert ((f a + -1 * f b) * (f a + -1 * f b) <= c * (a + -1 * b) * (c * (a + -1 * b))); [|nra].
  destruct (Rle_dec a b) as [L|L]; [specialize (S a b L)|specialize (S b a ltac:(lra))]; nra.
Qed.
Lemma square_minus_same s : square (minus s s) = 0.
Proof. unfold square, minus. induction s as [|a s IH]; simpl; auto. rewrite IH. ring. Qed.
(** What is added to both does not matter. *)
Lemma square_shifted u v s : length u = length v -> square (minus (plusR u s) (plusR v s)) = square (minus u v).
Proof.
  unfold square, minus. revert v s. induction u as [|a u IH]; intros [|b v] [|c s]; simpl; try discriminate;
      intros H; auto.
  - pose proof (square_minus_same (c :: s)) as E. exact E.
  - rewrite IH by lia. ring.
Qed.

Lemma length_clamped c x : length (clamped c x) = length x.
Proof. revert x. induction c as [|[l h] c IH]; intros [|a x]; simpl; auto. Qed.
Lemma agree_lengths moves x y : agree moves x y -> length x = length moves /\ length y = length moves.
Proof.
  revert x y. induction moves as [|m moves IH]; intros [|a x] [|b y]; simpl; try tauto.
  intros [_ H]. destruct (IH _ _ H). lia.
Qed.
Lemma agree_clamped c moves x y : agree moves x y -> agree moves (clamped c x) (clamped c y).
Proof.
  revert moves x y. induction c as [|[l h] c IH]; intros [|m moves] [|a x] [|b y]; simpl; try tauto.
  intros [[H|H] G]; split; auto. right. now rewrite H.
Qed.
Lemma square_in_clamped c scale x y : length x = length y ->
  square_in scale (minus (clamped c x) (clamped c y)) <= square_in scale (minus x y).
Proof.
  unfold minus. revert scale x y. induction c as [|[l h] c IH]; intros scale [|a x] [|b y]; simpl; try discriminate;
      intros H; try lra.
  specialize (IH (tl scale) x y ltac:(lia)). set (k := Rmin _ _ + _). set (j := a + _). set (s := real _).
  assert (k * k <= j * j) as K.
  { apply square_between. unfold k, j, Rmin, Rmax. destruct (Rle_dec a b); repeat destruct (Rle_dec _ _); lra. }
  pose proof (Rle_0_sqr (/ s)) as S. unfold Rsqr in S. pose proof (Rmult_le_compat_r _ _ _ S K) as T. unfold Rdiv.
  replace (k * / s * (k * / s)) with (k * k * (/ s * / s)) by ring.
  replace (j * / s * (j * / s)) with (j * j * (/ s * / s)) by ring. lra.
Qed.
Lemma square_in_one d : square_in [] d = square d.
Proof.
  unfold square. induction d as [|a d IH]; simpl; auto. rewrite IH. unfold one, real. simpl. field.
Qed.
Lemma square_in_nonneg scale d : 0 <= square_in scale d.
Proof.
  revert scale. induction d as [|a d IH]; intros scale; simpl; [lra|].
  pose proof (Rle_0_sqr (a / real (hd one scale))). unfold Rsqr in *. specialize (IH (tl scale)). lra.
Qed.
